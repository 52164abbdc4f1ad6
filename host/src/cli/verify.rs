//! `stillpoint verify F.spt --move MOVE.toml`

use super::{Failure, output, read_spt};
use crate::certify::{Certificate, PlantProofs, Proof, VerifyError, verify_move};
use crate::movefile::MoveFile;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Verify a trajectory's certificate.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// The move file that says which machine and limits
    #[arg(long = "move", value_name = "MOVE.toml")]
    file: PathBuf,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = MoveFile::read(&arguments.file)?;
    let spt = read_spt(&arguments.trajectory)?;
    let result = verify_move(&spt, &file);
    if let (false, Err(VerifyError::NotCertified(_, certificate))) = (arguments.json, &result) {
        output::text(&certificate.text())?;
    }
    let certificate = result?;
    if arguments.json {
        return output::object(&object(&certificate));
    }
    let mut text = format!("{}{}\n", certificate.text(), certificate.verdict());
    text.extend(certificate.plants_in_words().map(|words| words + "\n"));
    output::text(&text)
}

/// A certificate in JSON; what could not be bounded is `null`.
pub(super) fn object(certificate: &Certificate) -> Value {
    let proof = |proof: &Proof| {
        json!({
            "limited": format!("{:?}", proof.limited),
            "index": proof.index,
            "name": proof.name,
            "unit": proof.unit,
            "limit": proof.limit,
            "bound": proof.bound,
            "margin": proof.margin(),
            "reached": proof.reached,
            "played": proof.played,
            "interval": proof.interval,
            "time_s": proof.time_s,
        })
    };
    let proofs: Vec<Value> = certificate.proofs.iter().map(proof).collect();
    let plant = |plant: &PlantProofs| {
        let simulated = plant.simulated.iter().map(|row| {
            json!({
                "name": row.name,
                "unit": row.unit,
                "limit": row.limit,
                "value": row.value,
                "left_after_the_move": row.after,
            })
        });
        json!({
            "name": plant.name,
            "holds": plant.broken().is_none(),
            "message": plant.broken(),
            "proofs": plant.proofs.iter().map(proof).collect::<Vec<_>>(),
            "simulated": simulated.collect::<Vec<_>>(),
            "departure": plant.departure,
        })
    };
    let plants: Vec<Value> = certificate.plants.iter().map(plant).collect();
    json!({
        "status": if certificate.is_certified() { "certified" } else { "not-certified" },
        "message": certificate.verdict(),
        "limiter_never_acts": certificate.limiter_never_acts(),
        "tool": certificate.tool,
        "trajectory_hash": format!("{:016x}", certificate.trajectory_hash),
        "limits_hash": format!("{:016x}", certificate.limits_hash),
        "proofs": proofs,
        "plants": plants,
    })
}

/// What a failed verification says in JSON.
pub(super) fn failed(failure: &(dyn std::error::Error + 'static)) -> Value {
    let mut answer = match failure.downcast_ref::<VerifyError>() {
        Some(VerifyError::NotCertified(_, certificate)) => object(certificate),
        Some(error) => json!({"status": error.status()}),
        None => json!({"status": "error"}),
    };
    answer["message"] = json!(failure.to_string());
    answer
}
