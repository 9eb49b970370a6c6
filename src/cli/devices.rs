//! `typodont devices`: what can be held, and why what is not there cannot be.

use super::{Failure, say};
use crate::device::{DRIVERS, Driver, Spec};

pub fn run() -> Result<(), Failure> {
    let spec = Spec::phantom_omni();
    let scripted =
        format!("a scripted hand on a simulated {}: {} N, {} mm steps", spec.name, spec.max_force, spec.resolution);
    let mut rows = vec![Row { device: "scripted".into(), what: scripted, help: None }];
    rows.extend(DRIVERS.iter().flat_map(|driver| rows_of(*driver)));
    let width = rows.iter().map(|row| row.device.len()).max().unwrap_or_default();
    for Row { device, what, help } in rows {
        say(format!("{device:width$}  {what}"))?;
        if let Some(help) = help {
            say(format!("    help: {help}"))?;
        }
    }
    Ok(())
}

struct Row {
    /// What `--device` takes.
    device: String,
    what: String,
    help: Option<String>,
}

fn rows_of(driver: &dyn Driver) -> Vec<Row> {
    let name = driver.name();
    match driver.find() {
        Ok(found) if found.is_empty() => {
            vec![Row { device: name.into(), what: "nothing found".into(), help: Some(driver.about().into()) }]
        }
        Ok(found) => found
            .into_iter()
            .map(|found| {
                let device = if found.argument.is_empty() { name.into() } else { format!("{name}:{}", found.argument) };
                Row { device, what: found.title, help: None }
            })
            .collect(),
        Err(trouble) => vec![Row { device: name.into(), what: trouble.what, help: Some(trouble.help) }],
    }
}
