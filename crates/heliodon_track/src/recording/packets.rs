//! Packets in a file, as they came: `seconds hex`.

use super::{LATEST_S, RecordingError, Words, lines, read, write};
use std::fmt::Write;
use std::path::Path;

/// What UDP carries at most, bytes.
const LONGEST: usize = 65_507;

/// A packet at its time.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedPacket {
    /// When it came, seconds from 0 up.
    pub seconds: f64,
    /// Its bytes, at most 65,507.
    pub packet: Vec<u8>,
}

/// Packets in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PacketLog {
    packets: Vec<LoggedPacket>,
}

impl PacketLog {
    /// The packets, in the order of their times.
    #[must_use]
    pub fn packets(&self) -> &[LoggedPacket] {
        &self.packets
    }

    /// Appends a packet. One that is before the last, or too long, is not taken; the answer says so.
    pub fn push(&mut self, seconds: f64, packet: impl Into<Vec<u8>>) -> bool {
        let packet = packet.into();
        let last_s = self.packets.last().map_or(0.0, |last| last.seconds);
        let good = (last_s..=LATEST_S).contains(&seconds) && packet.len() <= LONGEST;
        if good {
            self.packets.push(LoggedPacket { seconds, packet });
        }
        good
    }

    /// Reads the text of a log; one without any packet is a log, too.
    ///
    /// # Errors
    ///
    /// The first line that is none, with line, column and remedy.
    pub fn parse(text: &str) -> Result<Self, RecordingError> {
        let mut packets: Vec<LoggedPacket> = Vec::new();
        for mut words in lines(text) {
            let above_s = packets.last().map_or(0.0, |above| above.seconds);
            let seconds = words.moment(above_s)?;
            // a packet may be empty
            let packet = words.word().map_or(Ok(Vec::new()), |hex| bytes(hex, &words))?;
            words.end()?;
            packets.push(LoggedPacket { seconds, packet });
        }
        Ok(Self { packets })
    }

    /// Reads a file.
    ///
    /// # Errors
    ///
    /// As [`PacketLog::parse`]; where the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        read(path, Self::parse)
    }

    /// The text that [`PacketLog::parse`] reads as the same log.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = "# Heliodon: seconds, and a packet's bytes\n".to_owned();
        for LoggedPacket { seconds, packet } in &self.packets {
            // writing to a string does not fail
            let _ = write!(text, "{seconds} ");
            for byte in packet {
                let _ = write!(text, "{byte:02x}");
            }
            text.push('\n');
        }
        text
    }

    /// Writes a file.
    ///
    /// # Errors
    ///
    /// Where it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        write(path, &self.to_text())
    }
}

fn bytes(hex: &str, words: &Words<'_>) -> Result<Vec<u8>, RecordingError> {
    if let Some(wrong) = hex.chars().find(|c| !c.is_ascii_hexdigit()) {
        return words.wrong(format!("`{wrong}` is no hexadecimal digit"), "write two of 0 to 9 and a to f for each byte");
    }
    if !hex.len().is_multiple_of(2) {
        return words.wrong("a byte lacks its second digit", "write two hexadecimal digits for each byte");
    }
    if hex.len() / 2 > LONGEST {
        return words.wrong(format!("the packet has {} bytes", hex.len() / 2), format!("UDP carries at most {LONGEST}"));
    }
    let digit = |c: u8| (c as char).to_digit(16).unwrap_or_default() as u8;
    Ok(hex.as_bytes().chunks_exact(2).map(|two| digit(two[0]) << 4 | digit(two[1])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_come_back_as_they_were() {
        let mut log = PacketLog::default();
        assert!(log.push(0.0, []) && log.push(0.1, (0..=255).collect::<Vec<u8>>()) && log.push(0.1, b"fr 1\n"));
        assert!(!log.push(0.0, b"late") && !log.push(1.0, vec![0; LONGEST + 1]) && !log.push(f64::NAN, []));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tracker.packets");
        log.write(&path).unwrap();
        assert_eq!(PacketLog::read(&path).unwrap(), log);
    }

    #[test]
    fn what_is_wrong_is_told_with_line_and_column() {
        let fault = |text: &str| PacketLog::parse(text).unwrap_err().to_string();
        for (text, expected) in [
            ("0 00\nx 00", "2:1: `x` is no number; begin the line with seconds"),
            ("1 00\n0.5 00", "2:1: 0.5 comes after 1; sort the lines by their seconds"),
            ("# log\n0 0g", "2:3: `g` is no hexadecimal digit; write two of 0 to 9 and a to f for each byte"),
            ("0 0", "1:3: a byte lacks its second digit; write two hexadecimal digits for each byte"),
            ("0 00 00", "1:6: `00` is too much; take it out, or put # before it"),
        ] {
            assert_eq!(fault(text), expected);
        }
        assert!(fault(&format!("0 {}", "0".repeat(2 * LONGEST + 2))).contains("65508 bytes"));
        assert_eq!(PacketLog::parse("0 AbCd\n1").unwrap().packets()[0].packet, [0xab, 0xcd]);
    }
}
