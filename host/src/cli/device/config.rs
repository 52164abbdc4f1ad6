//! `stillpoint device config`

use super::line::{self, Board, Explained};
use super::{drives_file, words};
use crate::cli::{Failure, FileError, output};
use crate::device::DeviceError;
use crate::movefile::MoveFile;
use crate::simulate::trajectory::board_limits;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use stillpoint_shared::config::Config;
use stillpoint_shared::protocol::{Denial, Request, Response};
use stillpoint_shared::status::Refusal;
use stillpoint_shared::{DriveConfig, Limits, ordinal};
use toml::{Table, Value};

/// Show or change limits and settings; without options they are shown. All are kept over a loss of power. They can be
/// changed in the states Idle and Ready; what was loaded is then forgotten.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Send the limits of this move file: those a trajectory was planned for
    #[arg(long = "move", value_name = "MOVE.toml")]
    move_file: Option<PathBuf>,
    /// Send settings of the executor: tolerances, monitors, ramps; names as shown, those left out stay
    #[arg(long, value_name = "SETTINGS.toml")]
    settings: Option<PathBuf>,
    /// Send the drives' configuration, as it is shown (an example: docs/board.md); a controller with other drives than before starts
    /// anew
    #[arg(long, value_name = "DRIVES.toml")]
    drives: Option<PathBuf>,
}

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    // Files first: nothing is sent if one of them is wrong.
    let limits = arguments.move_file.as_deref().map(limits_of).transpose()?;
    let settings = arguments.settings.as_deref().map(table).transpose()?;
    let drives = arguments.drives.as_deref().map(drives_of).transpose()?;
    if let Some(changes) = &settings {
        changed(Config::default(), changes.clone())?;
    }
    let mut board = line.open(None)?;
    if let Some(limits) = &limits {
        set_limits(&mut board, limits)?;
    }
    if let Some(changes) = settings {
        let config = changed(config(&mut board)?, changes)?;
        board
            .order(&Request::SetConfig(config))
            .map_err(Explained::from)?;
    }
    if let Some(drives) = &drives {
        let request = Request::SetDrives {
            bus: *drives.bus(),
            axes: drives.axes().iter().copied().collect(),
        };
        board.order(&request).map_err(Explained::from)?;
    }
    show(line, &mut board)
}

/// The limits of a move file as the board knows them.
pub(super) fn limits_of(path: &Path) -> Result<Limits, Failure> {
    let file = MoveFile::read(path)?;
    Ok(board_limits(&file.limits, file.machine.plant())?)
}

pub(super) fn set_limits(board: &mut Board, limits: &Limits) -> Result<(), Explained> {
    let request = Request::SetLimits(limits.axes().iter().copied().collect());
    Ok(board.order(&request)?)
}

fn unexpected(request: &'static str) -> DeviceError {
    DeviceError::Unexpected { request }
}

fn config(board: &mut Board) -> Result<Config, DeviceError> {
    match board.ask(&Request::GetConfig)? {
        Response::Config(config) => Ok(config),
        _ => Err(unexpected("GetConfig")),
    }
}

fn read(path: &Path) -> Result<String, FileError> {
    std::fs::read_to_string(path).map_err(|source| FileError {
        verb: "read",
        path: path.to_owned(),
        source,
    })
}

fn table(path: &Path) -> Result<Table, Failure> {
    toml::from_str(&read(path)?).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn drives_of(path: &Path) -> Result<DriveConfig, Failure> {
    Ok(drives_file::parse(path, &read(path)?)?)
}

/// The settings with some of them changed.
fn changed(config: Config, changes: Table) -> Result<Config, Failure> {
    let mut table = Table::try_from(config)?;
    overlay(&mut table, changes)?;
    Ok(table.try_into()?)
}

fn overlay(table: &mut Table, changes: Table) -> Result<(), Failure> {
    let names = table.keys().cloned().collect::<Vec<_>>().join(", ");
    for (name, change) in changes {
        match (table.get_mut(&name), change) {
            (Some(Value::Table(inner)), Value::Table(changes)) => overlay(inner, changes)?,
            (Some(place), change) => *place = change,
            (None, _) => {
                return Err(format!("there is no setting `{name}`: there are {names}").into());
            }
        }
    }
    Ok(())
}

fn show(line: &line::Arguments, board: &mut Board) -> Result<(), Failure> {
    // A board without limits knows no settings either.
    let not_yet = Denial::Executor(Refusal::NotConfigured);
    let limits = match board.ask(&Request::GetLimits) {
        Ok(Response::Limits(limits)) => Some(limits),
        Ok(_) => return Err(Explained::from(unexpected("GetLimits")).into()),
        Err(DeviceError::Denied(denial)) if denial == not_yet => None,
        Err(error) => return Err(Explained::from(error).into()),
    };
    let config = match config(board) {
        Ok(config) => Some(config),
        Err(DeviceError::Denied(denial)) if denial == not_yet => None,
        Err(error) => return Err(Explained::from(error).into()),
    };
    let drives = match board.ask(&Request::GetDrives).map_err(Explained::from)? {
        Response::Drives(drives) => drives,
        _ => return Err(Explained::from(unexpected("GetDrives")).into()),
    };
    line.say_faults(board);
    if line.json {
        let hash = limits.as_ref().map(|limits| words::hash(limits.hash()));
        return output::object(&json!({
            "status": "done",
            "limits_hash": hash,
            "limits": limits.as_ref().map(Limits::axes),
            "settings": config,
            "drives": drives,
        }));
    }
    let mut text = match &limits {
        Some(limits) => format!("# limits {}\n", words::hash(limits.hash())),
        None => "# no limits yet: send them with --move\n".to_owned(),
    };
    for (axis, limits) in limits
        .iter()
        .flat_map(|limits| limits.axes().iter().enumerate())
    {
        text += &format!(
            "#   axis {}: {} N·m, {} N·m/s, {} rad/s; beyond {} rad/s {} N·m·s/rad less\n",
            ordinal(axis),
            limits.torque_nm,
            limits.torque_rate_nm_per_s,
            limits.speed_rad_per_s,
            limits.knee_speed_rad_per_s,
            limits.slope_nm_s_per_rad
        );
    }
    text += &match config {
        Some(config) => format!("\n# settings\n{}", toml::to_string(&config)?),
        None => "\n# no settings before there are limits\n".to_owned(),
    };
    text += &match drives {
        Some(drives) => format!("\n# drives\n{}", toml::to_string(&drives)?),
        None => "\n# no configuration of drives: simulated ones need none; for those on CAN, send with --drives one like\n\
                 # that in docs/board.md#drive-configuration\n"
            .to_owned(),
    };
    output::text(&text)
}
