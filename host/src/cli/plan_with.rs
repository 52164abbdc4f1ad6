//! `stillpoint plan MOVE.toml --with BASELINE`

use super::{Failure, encode_spt, output, verify, write_file};
use crate::baseline::{Baseline, BaselinePlan, plan_baseline};
use crate::movefile::MoveFile;
use crate::study::play;
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use stillpoint_shared::time;

pub(super) fn run(
    file: &MoveFile,
    baseline: Baseline,
    out: &Path,
    json: bool,
) -> Result<(), Failure> {
    let started = Instant::now();
    let BaselinePlan {
        trajectory,
        section,
        active,
        ..
    } = plan_baseline(file, baseline)?;
    write_file(out, &encode_spt(&trajectory, &section)?)?;
    if file.robust.is_some() {
        eprintln!("warning: {} takes no notice of [robust]", baseline.name());
    }
    let played = play(baseline.name(), file, &trajectory);
    let duration_s = time::seconds(trajectory.duration_ticks());
    let certificate = &section.certificate;
    if json {
        let played = match &played {
            Ok(run) => json!({
                "residual": run.metrics.residual(),
                "residual_is_strain": run.metrics.residual_strain.is_some(),
                "limited_ticks": run.recording.limited_ticks(),
            }),
            Err(error) => json!({"error": error.to_string()}),
        };
        return output::object(&json!({
            "status": "solved",
            "with": baseline.name(),
            "duration_s": duration_s,
            "binding_limit": {"limit": active.limit, "time_s": active.time_s},
            "intervals": trajectory.intervals().count(),
            "played": played,
            "seconds": {"total": started.elapsed().as_secs_f64()},
            "certificate": verify::object(certificate),
            "trajectory": out.display().to_string(),
        }));
    }
    let played = played.map_or_else(
        |error| format!("the executor does not play it to its end: {error}"),
        |run| {
            format!(
                "played by the executor, {} is left; the limiter acts in {} ticks",
                run.metrics.residual_in_words(),
                run.recording.limited_ticks()
            )
        },
    );
    output::text(&format!(
        "{:.3} ms, written to {}\n  {}: the shortest within all limits, in {:.1} s; a slightly shorter one breaks {} at {:.1} ms\n  \
         {} intervals; {}\n  {}\n",
        duration_s * 1e3,
        out.display(),
        baseline.name(),
        started.elapsed().as_secs_f64(),
        active.limit,
        active.time_s * 1e3,
        trajectory.intervals().count(),
        certificate.verdict(),
        played
    ))
}
