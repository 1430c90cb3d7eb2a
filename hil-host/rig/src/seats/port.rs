//! A serial port with a board.

use super::BAUD;
use super::link::Wire;
use serialport::SerialPort;
use std::io::ErrorKind;
use std::time::Duration;

/// An open serial port.
pub struct Port {
    name: String,
    port: Box<dyn SerialPort>,
}

/// Opens a serial port.
///
/// # Errors
/// One line with the ports that there are.
pub fn open(name: &str, baud: u32) -> anyhow::Result<Box<dyn SerialPort>> {
    serialport::new(name, baud).timeout(Duration::from_millis(100)).open().map_err(|e| {
        let why = e.to_string().to_lowercase();
        if why.contains("busy") {
            return anyhow::anyhow!(
                "{name}: another program has this serial port; end it, or watch the flight it logs: glider monitor DIR (fly's --log)"
            );
        }
        let known: Vec<String> = serialport::available_ports().unwrap_or_default().into_iter().map(|p| p.port_name).collect();
        let known = if known.is_empty() { "none found".to_owned() } else { known.join(", ") };
        anyhow::anyhow!("{name}: cannot open this serial port ({why}); ports: {known}")
    })
}

impl Port {
    /// Opens a port by name.
    ///
    /// # Errors
    /// As [`open`].
    pub fn open(name: &str) -> anyhow::Result<Self> {
        Ok(Self { name: name.to_owned(), port: open(name, BAUD)? })
    }

    /// What is open.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Wire for Port {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        send(&mut *self.port, bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        receive(&mut *self.port, into, wait)
    }

    fn describe(&self) -> String {
        format!("board on {}", self.name)
    }
}

/// Sends all bytes through a serial port.
pub(super) fn send(port: &mut dyn SerialPort, bytes: &[u8]) -> std::io::Result<()> {
    port.write_all(bytes)
}

/// Reads what comes within `wait`; 0 when nothing came.
pub(super) fn receive(port: &mut dyn SerialPort, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
    // Below 1 ms the port's poll would return at once for ever.
    let wait = wait.max(Duration::from_millis(1));
    if port.timeout() != wait {
        port.set_timeout(wait)?;
    }
    match port.read(into) {
        Ok(0) => Err(std::io::Error::new(ErrorKind::UnexpectedEof, "port closed")),
        Ok(n) => Ok(n),
        Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => Ok(0),
        Err(e) => Err(e),
    }
}
