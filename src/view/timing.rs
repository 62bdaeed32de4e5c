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
            if let Some(spread) = Spread::of(frames) {
                lines.push(format!("frame {what}: {}", spread.milliseconds()));
            }
        }
        if let [Some(baking), Some(idle)] = [&self.baking, &self.idle].map(|of| Spread::of(of)) {
            lines.push(format!(
                "frame while baking over frame without: {:.2}",
                baking.middle / idle.middle
            ));
        }
        if let Some(spread) = Spread::of(&self.answers) {
            lines.push(format!("input answered: {}", spread.milliseconds()));
        }
        for (what, times) in [
            ("direct light of changed lights", &self.relit_direct),
            ("all light of changed lights", &self.relit),
        ] {
            match Spread::of(times) {
                // Of a light that is dragged.
                Some(spread) if times.len() > FEW => lines.push(format!(
                    "{what} on the screen after {}",
                    spread.milliseconds()
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

/// How times spread, seconds.
struct Spread {
    middle: f64,
    p95: f64,
    p99: f64,
    longest: f64,
    count: usize,
}

impl Spread {
    /// None without times.
    fn of(seconds: &[f64]) -> Option<Self> {
        let mut sorted = seconds.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let at = |share: f64| sorted[(last as f64 * share).round() as usize];
        Some(Self {
            middle: at(0.5),
            p95: at(0.95),
            p99: at(0.99),
            longest: sorted[last],
            count: sorted.len(),
        })
    }

    fn milliseconds(&self) -> String {
        let [middle, p95, p99, longest] =
            [self.middle, self.p95, self.p99, self.longest].map(|seconds| 1e3 * seconds);
        format!(
            "{middle:.1} ms in the middle, {p95:.1} at the 95th percentile, {p99:.1} at the 99th, \
             {longest:.1} at most, of {}",
            self.count
        )
    }
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
        let spread = "11.0 ms in the middle, 19.0 at the 95th percentile, 20.0 at the 99th, \
                      20.0 at most, of 20";
        assert_eq!(lines[1], format!("frame without: {spread}"));
        assert!(lines[2].ends_with("2.00"), "{lines:?}");
    }
}
