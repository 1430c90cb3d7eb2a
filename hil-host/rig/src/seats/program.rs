//! A controller that is another program: it reads the bytes of the line from standard input and answers on standard output, as
//! `firmware/helm/examples/law.rs` does.

use super::link::Wire;
use anyhow::Context;
use std::io::{Error, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Wire to such a program; it is ended with the wire.
pub struct Program {
    path: PathBuf,
    child: Child,
    said: Receiver<Vec<u8>>,
    /// Bytes heard and not asked for yet.
    left: Vec<u8>,
}

impl Program {
    /// Starts it.
    ///
    /// # Errors
    /// The system does not start it.
    pub fn start(path: &Path) -> anyhow::Result<Self> {
        let (child, said) = started(path).with_context(|| format!("{}: this program cannot be started", path.display()))?;
        Ok(Self { path: path.to_owned(), child, said, left: Vec::new() })
    }
}

fn started(path: &Path) -> std::io::Result<(Child, Receiver<Vec<u8>>)> {
    let mut child = Command::new(path).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut output = child.stdout.take().ok_or(ErrorKind::BrokenPipe)?;
    let (say, said) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(n @ 1..) = output.read(&mut bytes) {
            if say.send(bytes.get(..n).unwrap_or_default().to_vec()).is_err() {
                return;
            }
        }
    });
    Ok((child, said))
}

impl Wire for Program {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let input = self.child.stdin.as_mut().ok_or(ErrorKind::BrokenPipe)?;
        input.write_all(bytes)?;
        input.flush()
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        if self.left.is_empty() {
            match self.said.recv_timeout(wait) {
                Ok(bytes) => self.left = bytes,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(Error::new(ErrorKind::BrokenPipe, "the program has ended")),
            }
        }
        let n = into.len().min(self.left.len());
        for (to, from) in into.iter_mut().zip(self.left.drain(..n)) {
            *to = from;
        }
        Ok(n)
    }

    fn describe(&self) -> String {
        format!("the program {}", self.path.display())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
