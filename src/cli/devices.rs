//! `typodont devices`: lists connected devices, and the reason for each driver that finds none.

use super::{CliError, print_line};
use typodont_core::device::DeviceSpec;
use typodont_devices::{DRIVERS, Driver};

pub fn run() -> Result<(), CliError> {
    let spec = DeviceSpec::phantom_omni();
    let scripted = format!(
        "a scripted operator on a simulated {}: {} N, {} mm resolution",
        spec.name, spec.max_force, spec.resolution
    );
    let mut rows = vec![DeviceRow { device: "scripted".into(), what: scripted, help: None }];
    rows.extend(DRIVERS.iter().flat_map(|driver| rows_of(*driver)));
    let width = rows.iter().map(|row| row.device.len()).max().unwrap_or_default();
    for DeviceRow { device, what, help } in rows {
        print_line(format!("{device:width$}  {what}"))?;
        if let Some(help) = help {
            print_line(format!("    help: {help}"))?;
        }
    }
    Ok(())
}

struct DeviceRow {
    /// Value of `--device` that selects this device.
    device: String,
    what: String,
    help: Option<String>,
}

fn rows_of(driver: &dyn Driver) -> Vec<DeviceRow> {
    let name = driver.name();
    match driver.discover() {
        Ok(found) if found.is_empty() => {
            vec![DeviceRow {
                device: name.into(),
                what: "no device found".into(),
                help: Some(driver.description().into()),
            }]
        }
        Ok(found) => found
            .into_iter()
            .map(|found| {
                let device = if found.argument.is_empty() { name.into() } else { format!("{name}:{}", found.argument) };
                DeviceRow { device, what: found.title, help: None }
            })
            .collect(),
        Err(trouble) => vec![DeviceRow { device: name.into(), what: trouble.message, help: Some(trouble.help) }],
    }
}
