//! The law that is asked.

use crate::flight::image_file::ImageFile;
use crate::seats::in_process::InProcess;
use crate::seats::program::Program;
use crate::seats::{Link, Seat, qemu};
use anyhow::{Context, bail, ensure};
use object::{Architecture, Object as _};
use signals::WIRE_VERSION;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Which law.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Law {
    /// The one that this program was built with.
    Here,
    /// A flight image, in QEMU.
    Image(PathBuf),
    /// A program that speaks the line on its standard input and output.
    Program(PathBuf),
    /// A commit of the sources in the present folder, by its hash.
    Commit(String),
}

/// Where laws of commits are built, in the folder of the sources.
const BUILT: &str = "target/laws";
/// The controller as a program, for commits that do not have it yet.
const EXAMPLE: &str = include_str!("../../../../firmware/helm/examples/law.rs");
const EXAMPLE_AT: &str = "firmware/helm/examples/law.rs";
/// Where the sources state the version of the line, and how.
const VERSION_AT: &str = "firmware/signals/src/link.rs";
const VERSION: &str = "WIRE_VERSION: u8 = ";
/// A program on this computer that has not answered for so long does not speak this line.
const PROGRAM_ANSWERS: Duration = Duration::from_secs(3);

impl Law {
    /// A file, or a commit of the sources in the present folder.
    ///
    /// # Errors
    /// Neither.
    pub fn named(name: &str) -> anyhow::Result<Self> {
        let path = Path::new(name);
        if !path.exists() {
            let hash = git(&["rev-parse", "--verify", "--quiet", &format!("{name}^{{commit}}")]);
            return hash.map(|hash| Self::Commit(hash.trim().to_owned())).map_err(|_| {
                anyhow::anyhow!("--law {name}: no file, and no commit of the sources in this folder; name an image (ELF), a program of firmware/helm/examples/law.rs, or a commit")
            });
        }
        ensure!(path.is_file(), "--law {name}: is a folder; name an image (ELF), a program, or a commit");
        let bytes = std::fs::read(path).with_context(|| format!("{name}: cannot read"))?;
        let is_image = object::File::parse(&*bytes).is_ok_and(|file| file.architecture() == Architecture::Arm);
        Ok(if is_image { Self::Image(path.to_owned()) } else { Self::Program(path.to_owned()) })
    }

    /// One line for a person.
    #[must_use]
    pub fn describe(&self) -> String {
        match self {
            Self::Here => "the law that this program was built with".to_owned(),
            Self::Image(path) => format!("the image {}, in QEMU", path.display()),
            Self::Program(path) => format!("the program {}", path.display()),
            Self::Commit(hash) => {
                git(&["log", "-1", "--format=%h (%s)", hash]).map_or_else(|_| hash.clone(), |line| line.trim().to_owned())
            }
        }
    }

    /// Opens it; a commit is built first, once.
    ///
    /// # Errors
    /// What is missing, and how to get it.
    pub fn open(&self) -> anyhow::Result<Box<dyn Seat>> {
        if let Some(theirs) = self.wire_version().filter(|theirs| *theirs != WIRE_VERSION) {
            bail!(
                "{}: speaks wire version {theirs}, this program version {WIRE_VERSION}: ask it with the glider of its release",
                self.describe()
            );
        }
        let program = |path: &Path| Ok::<_, anyhow::Error>(Box::new(Link::new(Program::start(path)?).patience(PROGRAM_ANSWERS)));
        Ok(match self {
            Self::Here => Box::new(Link::new(InProcess::default())),
            Self::Image(path) => Box::new(Link::new(qemu::Qemu::start(path, None)?)),
            Self::Program(path) => program(path)?,
            Self::Commit(hash) => program(&built(hash)?)?,
        })
    }

    /// Version of the line as an image's facts or a commit's sources state it; a program says its own when it is asked.
    fn wire_version(&self) -> Option<u8> {
        match self {
            Self::Image(path) => ImageFile::read(path).ok().map(|image| image.facts.wire),
            Self::Commit(hash) => {
                let source = git(&["show", &format!("{hash}:{VERSION_AT}")]).ok()?;
                source.split_once(VERSION)?.1.split_once(';')?.0.parse().ok()
            }
            Self::Here | Self::Program(_) => None,
        }
    }
}

/// Commits after `a` up to `b`, and `a` before them, oldest first.
///
/// # Errors
/// Not such commits.
pub fn commits(a: &str, b: &str) -> anyhow::Result<Vec<Law>> {
    let (Law::Commit(first), Law::Commit(last)) = (Law::named(a)?, Law::named(b)?) else { bail!("{a}..{b}: name two commits") };
    let after = git(&["rev-list", "--reverse", "--first-parent", &format!("{first}..{last}")])?;
    let all: Vec<Law> = std::iter::once(first).chain(after.lines().map(str::to_owned)).map(Law::Commit).collect();
    ensure!(all.len() > 1, "{a}..{b}: {b} does not come after {a}");
    Ok(all)
}

fn git(arguments: &[&str]) -> anyhow::Result<String> {
    let out = Command::new("git").args(arguments).output().context("git cannot be started")?;
    ensure!(out.status.success(), "git {}: {}", arguments.join(" "), String::from_utf8_lossy(&out.stderr).trim());
    Ok(String::from_utf8(out.stdout)?)
}

/// The controller of a commit as a program.
fn built(hash: &str) -> anyhow::Result<PathBuf> {
    let top = PathBuf::from(git(&["rev-parse", "--show-toplevel"])?.trim());
    let laws = top.join(BUILT);
    let program = laws.join(hash).join(if cfg!(windows) { "law.exe" } else { "law" });
    if program.exists() {
        return Ok(program);
    }
    let sources = laws.join(hash).join("sources");
    std::fs::create_dir_all(&sources).with_context(|| format!("{}: cannot make this folder", sources.display()))?;
    let mut archive =
        Command::new("git").args(["archive", hash]).current_dir(&top).stdout(Stdio::piped()).spawn().context("git archive")?;
    let bytes = archive.stdout.take().context("git archive says nothing")?;
    let unpacked = Command::new("tar").arg("-x").current_dir(&sources).stdin(bytes).status().context("tar cannot be started")?;
    ensure!(archive.wait()?.success() && unpacked.success(), "the sources of {hash} cannot be unpacked");
    let example = sources.join(EXAMPLE_AT);
    if !example.exists() {
        std::fs::write(&example, EXAMPLE).with_context(|| format!("{hash} has no controller to build ({EXAMPLE_AT} cannot be written)"))?;
    }
    // A target folder of its own: cargo knows the crates of two checkouts by the same names, and would take one's for the other's.
    let target = laws.join(hash).join("target");
    let done = Command::new("cargo")
        .args(["build", "--release", "--quiet", "-p", "helm", "--example", "law"])
        .current_dir(&sources)
        .env("CARGO_TARGET_DIR", &target)
        .status()
        .context("cargo cannot be started: a law of a commit is built from its sources")?;
    ensure!(done.success(), "the controller of {hash} cannot be built (cargo build -p helm --example law in {})", sources.display());
    let name = program.file_name().unwrap_or_default();
    std::fs::rename(target.join("release/examples").join(name), &program)
        .with_context(|| format!("{}: cannot write", program.display()))?;
    std::fs::remove_dir_all(&target).ok();
    Ok(program)
}
