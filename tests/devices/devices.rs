//! `typodont devices` lists every driver, whatever is connected.

use std::process::Command;
use typodont_devices::DRIVERS;

#[test]
fn every_driver_has_its_line() {
    // Aim: each way to reach a device is listed, in order, in columns, and whatever cannot be used says what to do. Method:
    // the program itself, on a machine with whatever it has.
    let output = Command::new(env!("CARGO_BIN_EXE_typodont")).arg("devices").output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let (help, devices): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with("    help: "));
    assert!(help.iter().all(|line| line.len() > 20), "{text}");
    let mut names: Vec<&str> = devices.iter().map(|line| line.split([' ', ':']).next().unwrap()).collect();
    names.dedup();
    let drivers = DRIVERS.iter().map(|driver| driver.name());
    assert_eq!(names, std::iter::once("scripted").chain(drivers).collect::<Vec<_>>(), "{text}");
    let column = devices[0].find("a scripted").unwrap();
    for line in &devices {
        assert!(line[..column].ends_with("  ") && !line[column..].starts_with(' '), "{text}");
    }
}
