//! A curriculum: when a stage of training is over.

use mpgx_lang::plan::{Stage, Until};

use crate::record::{StageEnd, Training};
use crate::statistics::mean;

/// What [`Until::measure`] may name.
pub(crate) const MEASURES: [&str; 4] = ["return", "error_m", "steps", "failures"];

/// Whether the stage that is going on is over, judged by the episodes of it that have ended.
pub(crate) fn is_over(stage: &Stage, training: &Training) -> bool {
    let began = training.stages.last().copied().unwrap_or_default();
    let steps = training.steps.last().map_or(0, |steps| steps - began.steps);
    let spent = stage.most_steps.is_some_and(|most| steps >= most as u64);
    spent || stage.until.as_ref().is_some_and(|until| holds(until, stage, training, began))
}

fn holds(until: &Until, stage: &Stage, training: &Training, began: StageEnd) -> bool {
    let count = training.returns.len();
    let Some(first) = count.checked_sub(until.episodes).filter(|first| *first >= began.episodes as usize)
    else {
        return false;
    };
    let failed = |ended: &Option<u16>| {
        ended.and_then(|end| stage.world.ends.get(usize::from(end))).is_some_and(|end| end.failure)
    };
    let length = |episode: usize| {
        let before = episode.checked_sub(1).map_or(0, |before| training.steps[before]);
        (training.steps[episode] - before) as f64
    };
    let mean = match until.measure.as_str() {
        "return" => mean(&training.returns[first..]),
        "error_m" => mean(&training.error_m[first..]),
        "steps" => mean(&(first..count).map(length).collect::<Vec<_>>()),
        _ => {
            training.ended[first..].iter().filter(|ended| failed(ended)).count() as f64
                / until.episodes as f64
        }
    };
    if until.below { mean < until.bound } else { mean > until.bound }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::sample;

    fn stage(until: Option<(&str, bool, f64, usize)>, most_steps: Option<usize>) -> Stage {
        let until = until.map(|(measure, below, bound, episodes)| Until {
            measure: measure.into(),
            below,
            bound,
            episodes,
        });
        Stage { until, ..sample::stage(most_steps) }
    }

    /// Five episodes; the stage before ended with the second.
    fn training() -> Training {
        Training {
            steps: vec![7, 14, 18, 25, 27],
            returns: vec![9.0, 9.0, -4.0, -1.0, -3.0],
            error_m: vec![0.0, 0.0, 0.4, 0.2, 0.3],
            ended: vec![None, None, Some(0), None, Some(1)],
            stages: vec![StageEnd { steps: 14, episodes: 2 }],
            ..Training::default()
        }
    }

    #[test]
    fn the_last_episodes_of_this_stage_decide() {
        for (measure, value) in [
            ("return", -8.0 / 3.0),
            ("error_m", 0.3),
            ("steps", 13.0 / 3.0),
            // The second end of the sample's world is no failure.
            ("failures", 1.0 / 3.0),
        ] {
            let over = |below, bound| is_over(&stage(Some((measure, below, bound, 3)), None), &training());
            let (above, below) = (value + 1e-9, value - 1e-9);
            let all = [over(true, above), over(true, below), over(false, above), over(false, below)];
            assert_eq!(all, [true, false, false, true], "{measure}");
        }
        // Two episodes: those of -1 and -3. Four: one of them belongs to the stage before.
        assert!(is_over(&stage(Some(("return", false, -2.1, 2)), None), &training()));
        assert!(!is_over(&stage(Some(("return", false, -1e9, 4)), None), &training()));
    }

    #[test]
    fn steps_are_counted_from_the_beginning_of_the_stage() {
        assert!(is_over(&stage(None, Some(13)), &training()));
        assert!(!is_over(&stage(None, Some(14)), &training()));
        assert!(!is_over(&stage(None, None), &training()));
        assert!(!is_over(&stage(None, Some(1)), &Training::default()));
    }
}
