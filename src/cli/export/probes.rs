//! Options of probes.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;

use crate::cli::output::writable;
use crate::cli::progress::{Bar, catch_interrupts, interrupted};
use mesolux::error::{Error, Result};
use mesolux::export::probes::{self, Grid, ProbeFile, Probes};
use mesolux::scene::Scene;
use mesolux::solver::Lit;

#[derive(Args)]
#[command(next_help_heading = "Probes")]
pub struct ProbeOptions {
    /// Write light at probes: irradiance in spherical harmonics of the second degree, and the walls
    /// about each, through which light between probes does not come; may be given several times
    #[arg(long, value_name = "OUT.json|.safetensors")]
    pub probes: Vec<PathBuf>,
    /// Probes along x, y and z in the box about the scene
    #[arg(long, value_name = "NXxNYxNZ", default_value = "8x4x8", value_parser = counts)]
    probe_grid: [u32; 3],
    /// Probes at the points of a file instead, `x y z` a line
    #[arg(
        long,
        value_name = "POINTS",
        requires = "probes",
        conflicts_with = "probe_grid"
    )]
    probe_points: Option<PathBuf>,
}

/// Most probes of a grid.
const MOST_PROBES: u32 = 100_000;

fn counts(text: &str) -> std::result::Result<[u32; 3], String> {
    let numbers: Vec<u32> = (text.split(['x', 'X', '×']))
        .map_while(|n| n.parse().ok().filter(|n| (1..=1024).contains(n)))
        .collect();
    match <[u32; 3]>::try_from(numbers) {
        Ok(counts)
            if text.split(['x', 'X', '×']).count() == 3
                && counts.iter().product::<u32>() <= MOST_PROBES =>
        {
            Ok(counts)
        }
        _ => Err(format!("must be like 8x4x8, {MOST_PROBES} probes at most")),
    }
}

impl ProbeOptions {
    pub fn check(&self) -> Result<()> {
        for path in &self.probes {
            ProbeFile::of(path)?;
            writable(path)?;
        }
        Ok(())
    }

    /// The grid, and the places of the probes; none where none are asked for.
    pub fn positions(&self, scene: &Scene) -> Result<(Option<Grid>, Vec<DVec3>)> {
        match &self.probe_points {
            _ if self.probes.is_empty() => Ok((None, Vec::new())),
            Some(path) => Ok((None, probes::read_positions(path)?)),
            None => {
                let grid = Grid::about(scene, self.probe_grid);
                Ok((Some(grid), grid.positions()))
            }
        }
    }

    pub fn write(
        &self,
        scene: &Scene,
        lit: &Lit<'_>,
        grid: Option<Grid>,
        positions: &[DVec3],
    ) -> Result<()> {
        catch_interrupts();
        let bar = Bar::new();
        let go_on = |found: usize| {
            bar.show(format!("light at {found} of {} probes", positions.len()));
            !interrupted()
        };
        let found = Probes::new(scene, lit, grid, positions, &go_on)?;
        bar.finish();
        let Some(found) = found else {
            let what = "probes: stopped by Ctrl-C, and not written";
            return Err(Error::Usage(what.into()));
        };
        let inside = found.list.iter().filter(|probe| !probe.valid).count();
        for path in &self.probes {
            found.write(path)?;
            tracing::info!(
                "{}: {} probes, {inside} of them within solids",
                path.display(),
                found.list.len()
            );
        }
        Ok(())
    }
}
