//! Times of frames and of answers to input.

use std::time::{Duration, Instant};

/// Times of a session, seconds.
#[derive(Debug, Default)]
pub struct Timing {
    /// Times of frames, from the start of their preparation to their presentation: during a bake,
    /// and without one.
    baking: Vec<f64>,
    idle: Vec<f64>,
    /// From an input to the end of the first frame that could show its effect.
    answers: Vec<f64>,
    /// From a change of the lights to the end of the first frame that shows what they emit, and of
    /// the first that shows all of their light.
    relit_direct: Vec<f64>,
    /// When the lights were changed that the next frame shows first.
    next_direct: Option<Instant>,
    relit: Vec<f64>,
    /// From the start of the program to the end of the first frame that shows light.
    first_light: Option<f64>,
}

/// Most times that are listed one by one; more are summarised.
const FEW: usize = 8;

impl Timing {
    pub fn frame(&mut self, taken: Duration, baking: bool) {
        let frames = if baking {
            &mut self.baking
        } else {
            &mut self.idle
        };
        frames.push(taken.as_secs_f64());
    }

    /// Whether a frame has been shown.
    pub fn has_begun(&self) -> bool {
        !(self.baking.is_empty() && self.idle.is_empty())
    }

    pub fn answer(&mut self, since: Instant) {
        self.answers.push(since.elapsed().as_secs_f64());
    }

    pub fn relit_direct(&mut self, since: Instant) {
        self.relit_direct.push(since.elapsed().as_secs_f64());
    }

    /// The next frame is the first that shows what lights emit that were changed then.
    pub fn relit_direct_next(&mut self, since: Instant) {
        self.next_direct = Some(since);
    }

    /// A frame was shown.
    pub fn relit_direct_shown(&mut self) {
        if let Some(since) = self.next_direct.take() {
            self.relit_direct(since);
        }
    }

    pub fn relit(&mut self, since: Instant) {
        self.relit.push(since.elapsed().as_secs_f64());
    }

    pub fn first_light(&mut self, since: Instant) {
        self.first_light
            .get_or_insert_with(|| since.elapsed().as_secs_f64());
    }

    /// Time of the last frame, during a bake or without one.
    pub fn last(&self, baking: bool) -> Option<f64> {
        let frames = if baking { &self.baking } else { &self.idle };
        frames.last().copied()
    }

    /// One line for each kind of time that was measured.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(seconds) = self.first_light {
            lines.push(format!("first picture with light after {seconds:.2} s"));
        }
        for (what, frames) in [("while baking", &self.baking), ("without", &self.idle)] {
            if let Some((median, most)) = spread(frames) {
                lines.push(format!(
                    "frame {what}: {median:.1} ms in the middle, {most:.1} ms at the 95th percentile of {}",
                    frames.len()
                ));
            }
        }
        if let (Some((baking, _)), Some((idle, _))) = (spread(&self.baking), spread(&self.idle)) {
            lines.push(format!(
                "frame while baking over frame without: {:.2}",
                baking / idle
            ));
        }
        if let Some((median, most)) = spread(&self.answers) {
            let worst = 1e3 * self.answers.iter().copied().fold(0.0, f64::max);
            lines.push(format!(
                "input answered in {median:.1} ms in the middle, {most:.1} ms at the 95th percentile, {worst:.1} ms at most, of {}",
                self.answers.len()
            ));
        }
        for (what, times) in [
            ("direct light of changed lights", &self.relit_direct),
            ("all light of changed lights", &self.relit),
        ] {
            match spread(times) {
                // Of a light that is dragged.
                Some((median, most)) if times.len() > FEW => lines.push(format!(
                    "{what} on the screen after {:.2} s in the middle, {:.2} s at the 95th \
                     percentile of {}",
                    1e-3 * median,
                    1e-3 * most,
                    times.len()
                )),
                _ => {
                    let line = |seconds: &f64| format!("{what} on the screen after {seconds:.2} s");
                    lines.extend(times.iter().map(line));
                }
            }
        }
        lines
    }
}

/// The median and the 95th percentile in milliseconds; None without values.
fn spread(seconds: &[f64]) -> Option<(f64, f64)> {
    let mut sorted = seconds.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| sorted.get(((sorted.len().max(1) - 1) as f64 * share).round() as usize);
    Some((1e3 * at(0.5)?, 1e3 * at(0.95)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_tell_what_there_was() {
        let mut timing = Timing::default();
        assert!(timing.lines().is_empty());
        for ms in 1..=20 {
            timing.frame(Duration::from_millis(2 * ms), true);
            timing.frame(Duration::from_millis(ms), false);
        }
        let lines = timing.lines();
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines[2].ends_with("2.00"), "{lines:?}");
    }
}
