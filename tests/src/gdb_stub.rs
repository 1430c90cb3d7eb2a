//! QEMU's gdb stub: remote serial protocol, as little as it takes. What fails is a test that fails.

use rig::seats::qemu::Qemu;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// A connection to the stub of a running QEMU.
pub struct Stub(TcpStream);

impl Stub {
    /// Has QEMU open its stub; the chip runs on.
    ///
    /// # Panics
    /// QEMU opens none.
    #[must_use]
    pub fn attach(qemu: &mut Qemu) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
        qemu.monitor(&format!("gdbserver tcp:127.0.0.1:{port}")).expect("QEMU's monitor");
        for _ in 0..200 {
            if let Ok(stream) = TcpStream::connect(("127.0.0.1", port)) {
                stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
                let mut stub = Self(stream);
                // Attaching has stopped the chip.
                stub.run();
                return stub;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("QEMU opens no gdb stub on port {port}");
    }

    fn send(&mut self, packet: &str) {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        write!(self.0, "${packet}#{sum:02x}").expect("the stub takes a packet");
    }

    /// The next packet's content, acknowledged.
    fn hear(&mut self) -> String {
        let mut byte = [0];
        let mut text = Vec::new();
        let mut inside = false;
        loop {
            self.0.read_exact(&mut byte).expect("the stub answers");
            match byte[0] {
                b'$' => inside = true,
                b'#' if inside => break,
                b if inside => text.push(b),
                _ => {}
            }
        }
        self.0.read_exact(&mut [0; 2]).expect("the stub's checksum");
        self.0.write_all(b"+").expect("the stub takes an acknowledgement");
        String::from_utf8_lossy(&text).into_owned()
    }

    /// The answer to a packet; stops told once more on the way are passed over.
    fn answer(&mut self) -> String {
        loop {
            let text = self.hear();
            if !text.starts_with(['T', 'S']) {
                return text;
            }
        }
    }

    fn order(&mut self, packet: &str) {
        self.send(packet);
        assert_eq!(self.answer(), "OK", "{packet}");
    }

    /// Lets the chip run on.
    pub fn run(&mut self) {
        self.send("c");
    }

    /// Stops the chip.
    ///
    /// # Panics
    /// The stub says something else.
    pub fn stop(&mut self) {
        self.0.write_all(&[3]).expect("the stub takes a break");
        self.stopped();
    }

    /// Waits until the chip has stopped.
    ///
    /// # Panics
    /// The stub says something else, or nothing for 20 s.
    pub fn stopped(&mut self) {
        let stopped = self.hear();
        assert!(stopped.starts_with('T') || stopped.starts_with('S'), "{stopped}");
    }

    /// A byte of memory, while the chip is stopped.
    ///
    /// # Panics
    /// There is no memory.
    #[must_use]
    pub fn byte(&mut self, address: u64) -> u8 {
        self.send(&format!("m{address:x},1"));
        u8::from_str_radix(&self.answer(), 16).expect("a byte")
    }

    /// Writes a byte of memory, while the chip is stopped.
    ///
    /// # Panics
    /// There is no memory.
    pub fn write(&mut self, address: u64, byte: u8) {
        self.order(&format!("M{address:x},1:{byte:02x}"));
    }

    /// Writes a core register (13: SP, 15: PC), while the chip is stopped.
    ///
    /// # Panics
    /// The stub refuses.
    pub fn register(&mut self, number: u32, value: u32) {
        // QEMU takes registers only from a client that has asked what there are.
        self.send("qXfer:features:read:target.xml:0,ffb");
        self.answer();
        self.order(&format!("P{number:x}={:08x}", value.swap_bytes()));
    }

    /// Sets a breakpoint, or clears it, while the chip is stopped.
    ///
    /// # Panics
    /// The stub refuses.
    pub fn breakpoint(&mut self, address: u64, set: bool) {
        self.order(&format!("{}1,{address:x},2", if set { 'Z' } else { 'z' }));
    }

    /// Stops the chip, flips one bit, lets it run on.
    pub fn flip(&mut self, address: u64, bit: u32) {
        self.stop();
        let byte = self.byte(address);
        self.write(address, byte ^ 1 << bit);
        self.run();
    }
}
