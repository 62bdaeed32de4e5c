//! `mesolux completions` and `mesolux man`.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory};
use clap_complete::Shell;
use mesolux::atomic_file::write_atomically;
use mesolux::error::{Error, Result};

use super::Cli;

/// Print completions for a shell
///
/// Bash: mesolux completions bash > ~/.local/share/bash-completion/completions/mesolux
#[derive(Args)]
pub struct CompletionsOptions {
    shell: Shell,
}

/// Write the manual pages, one for each command
#[derive(Args)]
pub struct ManOptions {
    /// The folder to write to, such as ~/.local/share/man/man1
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub fn completions(options: &CompletionsOptions) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut Cli::command(), "mesolux", &mut text);
    let written = std::io::stdout().write_all(&text);
    written.map_err(|source| Error::write(Path::new("stdout"), source))
}

pub fn man(options: &ManOptions) -> Result<()> {
    let folder = &options.output;
    std::fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
    let mut command = Cli::command();
    command.build();
    page(folder, "mesolux".into(), command.clone())?;
    let shown = command
        .get_subcommands()
        .filter(|c| !c.is_hide_set() && c.get_name() != "help");
    for of in shown {
        let name = format!("mesolux-{}", of.get_name());
        page(folder, name.clone(), of.clone().display_name(name))?;
    }
    Ok(())
}

fn page(folder: &Path, name: String, command: clap::Command) -> Result<()> {
    let page = clap_mangen::Man::new(command);
    write_atomically(&folder.join(format!("{name}.1")), |mut out| {
        page.render(&mut out)
    })
}
