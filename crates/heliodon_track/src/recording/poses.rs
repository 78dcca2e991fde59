//! Poses in a file: `seconds body x y z qx qy qz qw [buttons]`, or `seconds body lost [buttons]`.

use super::{RecordingError, Words, lines, read, write};
use crate::pose::{FARTHEST_M, Pose};
use crate::settings::MAX_BODIES;
use glam::{Quat, Vec3};
use std::fmt::Write;
use std::path::Path;

/// What a line should look like.
const FORM: &str = "write `seconds body x y z qx qy qz qw`, then buttons if there are any, or `seconds body lost`";

/// A body at one moment of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When, seconds from 0 up.
    pub seconds: f64,
    /// Which body, an index below [`MAX_BODIES`].
    pub body: usize,
    /// Where it is, in the coordinates of whoever recorded; none: it is not seen.
    pub pose: Option<Pose>,
    /// The buttons that are held down, by their bits; none: nothing is told of them.
    pub buttons: Option<u32>,
}

/// Poses in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseRecording {
    samples: Vec<Sample>,
}

impl PoseRecording {
    /// The samples, in the order of their times.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Appends a sample. One that is before the last, or is no sample of a recording, is not taken; the answer says so.
    pub fn push(&mut self, sample: Sample) -> bool {
        let last_s = self.samples.last().map_or(0.0, |last| last.seconds);
        let pose = sample.pose.is_none_or(|pose| pose.checked().is_some());
        let good = (last_s..=super::LATEST_S).contains(&sample.seconds) && sample.body < MAX_BODIES && pose;
        if good {
            self.samples.push(sample);
        }
        good
    }

    /// Reads the text of a recording.
    ///
    /// # Errors
    ///
    /// The first line that is none, with line, column and remedy; a text without any pose.
    pub fn parse(text: &str) -> Result<Self, RecordingError> {
        let mut samples: Vec<Sample> = Vec::new();
        for mut words in lines(text) {
            let above_s = samples.last().map_or(0.0, |above| above.seconds);
            samples.push(sample(&mut words, above_s)?);
        }
        if samples.is_empty() {
            return Err(RecordingError::new("there is no pose in it", FORM));
        }
        Ok(Self { samples })
    }

    /// Reads a file.
    ///
    /// # Errors
    ///
    /// As [`PoseRecording::parse`]; where the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        read(path, Self::parse)
    }

    /// The text that [`PoseRecording::parse`] reads as the same recording, to the last bit.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = "# Heliodon: seconds body x y z qx qy qz qw [buttons], in metres\n".to_owned();
        for Sample { seconds, body, pose, buttons } in &self.samples {
            // writing to a string does not fail
            let _ = write!(text, "{seconds} {body}");
            match pose {
                Some(pose) => {
                    for value in pose.position.to_array().into_iter().chain(pose.orientation.to_array()) {
                        let _ = write!(text, " {value}");
                    }
                }
                None => text.push_str(" lost"),
            }
            if let Some(buttons) = buttons {
                let _ = write!(text, " {buttons}");
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

fn sample(words: &mut Words<'_>, above_s: f64) -> Result<Sample, RecordingError> {
    let seconds = words.moment(above_s)?;
    let body = words.number(FORM)?;
    let Some(body) = (0..MAX_BODIES).find(|known| *known as f64 == body) else {
        let remedy = format!("give the body's index, a whole number from 0 to {}", MAX_BODIES - 1);
        return words.wrong(format!("{body} is no body"), remedy);
    };
    let (before, mark) = (words.at, words.word());
    if mark == Some("lost") {
        let buttons = buttons(words)?;
        return Ok(Sample { seconds, body, pose: None, buttons });
    }
    words.at = before;
    let mut values = [0.0; 7];
    for (i, value) in values.iter_mut().enumerate() {
        *value = words.number(FORM)? as f32;
        if i < 3 && value.abs() > FARTHEST_M {
            return words.wrong(format!("{value} metres are beyond any room"), format!("give at most {FARTHEST_M}"));
        }
    }
    let [x, y, z, qx, qy, qz, qw] = values;
    let Some(pose) = Pose::new(Vec3::new(x, y, z), Quat::from_xyzw(qx, qy, qz, qw)) else {
        let message = format!("the quaternion {qx} {qy} {qz} {qw} is no rotation");
        return words.wrong(message, "give x y z w of length 1: 0 0 0 1 is not turned");
    };
    let buttons = buttons(words)?;
    Ok(Sample { seconds, body, pose: Some(pose), buttons })
}

fn buttons(words: &mut Words<'_>) -> Result<Option<u32>, RecordingError> {
    let Some(word) = words.word() else { return Ok(None) };
    match word.parse() {
        Ok(buttons) => words.end().map(|()| Some(buttons)),
        Err(_) => words.wrong(format!("`{word}` are no buttons"), "give the sum of 1, 2, 4, ... for buttons 0, 1, 2, ..."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation;
    use heliodon_math::random::Pcg32;

    #[test]
    fn recordings_come_back_to_the_last_bit() {
        let mut rng = Pcg32::new(8, 1);
        let mut recording = PoseRecording::default();
        for i in 0..500 {
            let mut vector = || Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-3.0, 3.0)));
            let pose = Pose::new(vector(), rotation::from_vector(vector()));
            let pose = if i % 9 == 0 { None } else { pose };
            let buttons = (i % 3 == 0).then_some(i as u32);
            assert!(recording.push(Sample { seconds: f64::from(i) / 60.0, body: (i % 3) as usize, pose, buttons }));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.poses");
        recording.write(&path).unwrap();
        assert_eq!(PoseRecording::read(&path).unwrap(), recording);
    }

    #[test]
    fn what_a_person_writes_is_read() {
        let text = "# a head\r\n0 0  0 1.7 0  0 0 0 1\r\n\n1.5 0 1 1.7 0 0 0 0 1 5 # button 0 and 2\n2 0 lost\n2 0 lost 4\n";
        let recording = PoseRecording::parse(text).unwrap();
        let told: Vec<_> = recording.samples().iter().map(|s| (s.seconds, s.pose.is_some(), s.buttons)).collect();
        assert_eq!(told, [(0.0, true, None), (1.5, true, Some(5)), (2.0, false, None), (2.0, false, Some(4))]);
    }

    #[test]
    fn what_is_wrong_is_told_with_line_and_column() {
        let fault = |text: &str| PoseRecording::parse(text).unwrap_err().to_string();
        let good = "0.5 0 0 0 0 0 0 0 1\n";
        for (line, place, message) in [
            ("x", "2:1: `x` is no number", "begin the line with seconds"),
            ("-1 0", "2:1: -1 seconds are none of a recording", "from 0 up"),
            ("inf 0", "2:1: `inf` is no number", "seconds"),
            ("0.25 0", "2:1: 0.25 comes after 0.5", "sort"),
            ("1", "2:2: the line ends too early", "seconds body x y z"),
            ("1 64", "2:3: 64 is no body", "from 0 to 63"),
            ("1 0.5", "2:3: 0.5 is no body", "from 0 to 63"),
            ("1 0 1 2", "2:8: the line ends too early", "qw"),
            ("1 0 1 2 é", "2:9: `é` is no number", "qw"),
            ("1 0 2000 0 0 0 0 0 1", "2:5: 2000 metres are beyond any room", "1000"),
            ("1 0 0 0 0 0 0 0 0", "2:17: the quaternion 0 0 0 0 is no rotation", "length 1"),
            ("1 0 0 0 0 0 0 0 1 -1", "2:19: `-1` are no buttons", "1, 2, 4"),
            ("1 0 0 0 0 0 0 0 1 1 7", "2:21: `7` is too much", "#"),
        ] {
            let fault = fault(&format!("{good}{line}"));
            assert!(fault.starts_with(place) && fault.contains(message), "{line}: {fault}");
        }
        assert_eq!(fault("# nothing\n"), format!("there is no pose in it; {FORM}"));
    }

    #[test]
    fn only_samples_in_their_order_are_taken() {
        let at = |seconds, pose| Sample { seconds, body: 0, pose, buttons: None };
        let mut recording = PoseRecording::default();
        let strange = Pose { position: Vec3::NAN, ..Pose::IDENTITY };
        let taken = [at(1.0, None), at(0.5, None), at(f64::NAN, None), at(2.0, Some(strange)), at(1.0, Some(Pose::IDENTITY))];
        assert_eq!(taken.map(|sample| recording.push(sample)), [true, false, false, false, true]);
        assert!(!recording.push(Sample { body: MAX_BODIES, ..at(3.0, None) }));
    }
}
