//! `glider completions`.

use super::{Output, Verdict};
use clap_complete::Shell;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider completions bash > ~/.local/share/bash-completion/completions/glider
  glider completions zsh > ~/.zfunc/_glider           with ~/.zfunc in fpath
  glider completions fish > ~/.config/fish/completions/glider.fish")]
pub struct Args {
    /// Shell that is to complete the commands and options of glider.
    shell: Shell,
}

/// Prints the completions.
///
/// # Errors
/// None.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut super::command(), "glider", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    output.emit(&serde_json::json!({ "shell": args.shell.to_string(), "script": script }), || print!("{script}"));
    Ok(Verdict::Ok)
}

#[cfg(test)]
mod tests {
    #[test]
    fn completions_of_every_shell_know_every_command() {
        for shell in [clap_complete::Shell::Bash, clap_complete::Shell::Zsh, clap_complete::Shell::Fish] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut super::super::command(), "glider", &mut script);
            let script = String::from_utf8(script).expect("text");
            for command in super::super::command().get_subcommands() {
                assert!(script.contains(command.get_name()), "{shell}: {}", command.get_name());
            }
        }
    }
}
