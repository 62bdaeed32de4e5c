//! Luminaires as measured: IES files (ANSI/IES LM-63, 1986 to 2019).

mod curve;
mod fields;
mod text;
mod writing;

use std::path::Path;

use super::Web;
use crate::error::{Error, Result};
use crate::input_file;
use fields::Photometry;
pub use writing::web_text;

/// A luminaire: a point with a distribution of intensity.
#[derive(Debug, Clone, PartialEq)]
pub struct Luminaire {
    /// Shares of the greatest intensity. θ = 0 is the nadir of type C, and the axis of types A and
    /// B, whose φ is 0 to the right and −90° up, seen along the axis.
    pub web: Web,
    /// Greatest intensity, cd.
    pub candela: f64,
    /// What was ignored and would change the light, one sentence each.
    pub warnings: Vec<String>,
}

impl Luminaire {
    /// Luminous flux: the integral of the intensity.
    pub fn lumens(&self) -> f64 {
        self.candela * self.web.solid_angle()
    }

    /// Reads a file of type C, B or A. Between the angles of the file the intensity follows cubics
    /// that do not overshoot (F. N. Fritsch and R. E. Carlson 1980); beyond them it is 0.
    ///
    /// # Errors
    /// A file that cannot be read; one that is not LM-63; a lamp whose tilt stands in another file;
    /// angles that do not ascend or are out of range; intensities that are negative, or all 0.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input_file::read(path)?;
        // Names of makers come in many encodings; nothing of them is used.
        let text = String::from_utf8_lossy(&bytes);
        let file = text::parse(path, &text)?;
        let refuse = |what: &str| Error::file(path, what);
        let warning = |what: &str| format!("{}: {what}", path.display());
        if file.is_web {
            let web = file.even_web().ok_or_else(|| {
                refuse("the angles of a web that Mesolux wrote are not even any more")
            })?;
            return Ok(Self {
                web,
                candela: 1.0,
                warnings: Vec::new(),
            });
        }
        let warnings = match file.tilts {
            true => vec![warning(
                "how the light depends on the lamp's tilt is not used",
            )],
            false => Vec::new(),
        };
        let (rows, columns, candelas) = file.web();
        let candela = candelas.iter().fold(0.0_f64, |most, &c| most.max(c));
        if candela <= 0.0 {
            return Err(refuse("there is no light: every intensity is 0"));
        }
        let shares = candelas.iter().map(|c| (c / candela) as f32).collect();
        Ok(Self {
            web: Web {
                rows,
                columns,
                shares,
            },
            candela,
            warnings,
        })
    }
}
