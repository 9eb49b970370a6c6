//! Exports to a school's systems: gradebooks, xAPI statements and their spool, Parquet.

use crate::support::bundle;
use crate::support::folder;
use crate::support::school;
use crate::support::tools;

use bundle::{complained, told, typodont};
use folder::folder;
use school::{Store, enter, session, statements_below, wrong_with};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn path(path: &Path) -> String {
    path.to_str().unwrap().to_string()
}

/// Hostile or merely unusual text in fields that people fill in.
fn hostile() -> [String; 5] {
    [
        "<script>alert(1)</script>".into(),
        "=cmd|'/c calc'!A1".into(),
        "\u{202e}txet desrever \u{2066}مرحبا".into(),
        "\u{1b}[2J\u{7}a\r\nb,\";\t=1+1".into(),
        "x".repeat(10_000),
    ]
}

#[test]
fn moodle_and_canvas_get_the_columns_they_ask_for() {
    let folder = folder("gradebook");
    for (person, points) in [("anna", 81.5), ("anna", 64.0), ("berk", 90.0), ("", 12.0)] {
        let mut one = session("5-grinding", person, points);
        one["scenario"]["title"] = json!("Class I on (36)");
        enter(&folder, &one);
    }
    let students = folder.join("students.csv");
    // As a spreadsheet of a country with a decimal comma writes it.
    fs::write(&students, "\u{feff}Participant;Student;ID;SIS Login ID;Email address\r\nanna;\"Yılmaz; Anna\";1001;ayilmaz;a@example.edu\r\n").unwrap();
    let run = |system: &str, more: &[&str]| {
        let file = folder.join(format!("{system}.csv"));
        let output = typodont(&[&["gradebook", &path(&folder), "--for", system, "-o", &path(&file)], more].concat());
        assert!(output.status.success(), "{}", complained(&output));
        (fs::read_to_string(file).unwrap(), complained(&output))
    };

    let (moodle, _) = run("moodle", &[]);
    let lines: Vec<&str> = moodle.lines().collect();
    assert_eq!(lines[0], "ID number,Class I on (36),Class I on (36) (feedback)");
    // The last session counts, and its feedback stands beside it.
    assert!(
        lines[1].starts_with("anna,64,") && lines[1].contains("Not passed: 64 of 100 points, 70 to pass."),
        "{moodle}"
    );
    assert!(lines[2].starts_with("berk,90,"), "{moodle}");
    assert_eq!(lines.len(), 3);
    // Another language changes the feedback, and nothing else.
    let (turkish, _) = run("moodle", &["--language", "tr"]);
    assert_eq!(turkish.lines().next(), Some(lines[0]));
    assert!(
        turkish.contains("Başarısız: 64 / 100 puan, geçme puanı 70.") && turkish.contains("Caries removed: 25 / 40."),
        "{turkish}"
    );
    assert!(!turkish.contains("passed") && !turkish.contains("points"), "{turkish}");
    let never = folder.join("never.csv");
    let unknown = typodont(&["gradebook", &path(&folder), "--for", "moodle", "-o", &path(&never), "--language", "xx"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(complained(&unknown).contains("known: en, tr"), "{}", complained(&unknown));

    let (canvas, complaints) = run("canvas", &["--students", &path(&students), "--take", "best"]);
    let lines: Vec<&str> = canvas.lines().collect();
    // A number in round brackets would be taken for an assignment of that id.
    assert_eq!(lines[0], "Student,ID,SIS User ID,SIS Login ID,Section,Class I on [36]");
    assert_eq!(lines[1], "    Points Possible,,,,,100");
    assert_eq!(lines[2], "\"Yılmaz; Anna\",1001,,ayilmaz,,81.5");
    assert!(
        complaints.contains("\"berk\" is not in the table") && complaints.contains("1 graded sessions have no"),
        "{complaints}"
    );
}

#[test]
fn statements_keep_the_rules_of_xapi() {
    // Aim: a strict store takes every statement, whatever people wrote. Method: the rules of xAPI 1.0.3, Part Two, as `school`
    // has them, over ordinary, unfinished, ungraded and hostile sessions.
    let folder = folder("xapi_rules");
    let mut sessions = vec![session("5-grinding", "anna", 81.5), session("3-detection", "", 40.0)];
    let mut ungraded = session("4-diagnosis", "berk", 0.0);
    ungraded["grade"] = Value::Null;
    ungraded["ended_because"] = json!("given up");
    ungraded["started"] = json!("yesterday");
    sessions.push(ungraded);
    for text in hostile() {
        // Codes and ids are no longer than a reader takes.
        let [code, id] = [64, 256].map(|most| text.chars().take(most).collect::<String>());
        let mut one = session("5-grinding", &code, 100.0);
        one["scenario"]["id"] = json!(id);
        one["scenario"]["title"] = json!(text);
        one["stages"][0]["answers"][0]["text"] = json!(text);
        one["stages"][0]["answers"][0]["value"] = json!(text);
        sessions.push(one);
    }
    sessions.iter().for_each(|one| drop(enter(&folder, one)));
    let spool = folder.join("spool");
    let make = |more: &[&str]| {
        let fixed =
            ["xapi", "make", &path(&folder), "--spool", &path(&spool), "--home-page", "https://school.example.edu/"];
        let output = typodont(&[&fixed, more].concat());
        assert!(output.status.success(), "{}", complained(&output));
        told(&output)
    };
    make(&["--platform", "station-07"]);
    let all = statements_below(&spool.join("waiting"));
    let wrong: Vec<String> = all.iter().flat_map(wrong_with).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let ids: BTreeSet<&str> = all.iter().map(|s| s["id"].as_str().unwrap()).collect();
    assert_eq!(ids.len(), all.len(), "every statement has an id of its own");
    let verbs: BTreeSet<&str> = all.iter().filter_map(|s| s["verb"]["id"].as_str()?.rsplit('/').next()).collect();
    assert_eq!(verbs, ["answered", "completed", "failed", "initialized", "passed", "terminated"].into());
    let likert = all.iter().find(|s| s["object"]["definition"]["interactionType"] == "likert").unwrap();
    assert_eq!(likert["result"]["response"], "likert_4");
    assert_eq!(likert["object"]["definition"]["scale"].as_array().unwrap().len(), 5);
    // Told again, nothing is put again; told under a key, nobody is called by a code.
    assert!(make(&["--platform", "station-07"]).contains("0 statements of 0 sessions"));
    let key = folder.join("key");
    fs::write(&key, "a secret that is long enough\n").unwrap();
    let hidden = folder.join("hidden");
    let output = typodont(&[
        "xapi",
        "make",
        &path(&folder),
        "--spool",
        &path(&hidden),
        "--home-page",
        "https://school.example.edu",
        "--pseudonym-key",
        &path(&key),
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    for statement in statements_below(&hidden.join("waiting")) {
        assert!(!statement.to_string().contains("anna") && wrong_with(&statement).is_empty(), "{statement}");
    }
}

#[test]
fn the_judge_of_statements_can_find_fault() {
    // Aim: rules that let everything pass would prove nothing. Method: one fault each.
    let folder = folder("xapi_faults");
    enter(&folder, &session("5-grinding", "anna", 81.5));
    let spool = folder.join("spool");
    let output = typodont(&[
        "xapi",
        "make",
        &path(&folder),
        "--spool",
        &path(&spool),
        "--home-page",
        "https://school.example.edu",
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    let all = statements_below(&spool.join("waiting"));
    let good = all.iter().find(|s| s["result"]["score"]["scaled"].is_number()).unwrap();
    assert_eq!(wrong_with(good), Vec::<String>::new());
    for (pointer, fault) in [
        ("/result/score/scaled", json!(1.86)),
        ("/result/completion", json!("yes")),
        ("/result/duration", json!("12 minutes")),
        ("/verb/id", json!("nope")),
        ("/id", json!("1234")),
        ("/timestamp", json!("yesterday")),
        ("/actor/account/homePage", json!("school")),
        ("/context/registration", Value::Null),
        ("/object/definition/name", json!("no language map")),
    ] {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = fault;
        assert!(!wrong_with(&bad).is_empty(), "{pointer} was let through");
    }
}

#[test]
fn a_store_that_hangs_up_gets_every_statement_once() {
    // Aim: an answer that is lost on its way back costs nothing. Method: a store that writes down every request and drops every
    // third connection before answering, and is busy or in conflict now and then.
    let folder = folder("hanging_up");
    for n in 0..9 {
        enter(&folder, &session("5-grinding", &format!("student-{n}"), 50.0 + f64::from(n)));
    }
    let (spool, store) = (folder.join("spool"), Store::start());
    let output = typodont(&[
        "xapi",
        "make",
        &path(&folder),
        "--spool",
        &path(&spool),
        "--home-page",
        "https://school.example.edu",
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    let expected: BTreeSet<String> =
        statements_below(&spool.join("waiting")).iter().map(|s| s["id"].as_str().unwrap().into()).collect();
    let secret = folder.join("secret");
    fs::write(&secret, "secret\n").unwrap();
    let send = |endpoint: &str, secret: &Path| {
        typodont(&[
            "xapi",
            "send",
            &path(&spool),
            "--endpoint",
            endpoint,
            "--key",
            "station",
            "--secret-file",
            &path(secret),
            "--patience",
            "20",
        ])
    };
    let output = send(&store.endpoint(), &secret);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(told(&output).contains("0 sessions waiting, 9 sent, 0 refused"), "{}", told(&output));
    let kept = store.kept();
    assert_eq!(kept.iter().cloned().collect::<BTreeSet<String>>(), expected);
    assert_eq!(kept.len(), expected.len(), "nothing is kept twice");
    assert!(store.hung_up() > 2, "{}", store.hung_up());

    // Over a plain line to elsewhere, the secret is not told; and a wrong one is said to be wrong.
    let output = send("http://lrs.example.edu/xapi", &secret);
    assert_eq!(output.status.code(), Some(2), "{}", complained(&output));
    enter(&folder, &session("5-grinding", "late", 99.0));
    typodont(&["xapi", "make", &path(&folder), "--spool", &path(&spool), "--home-page", "https://school.example.edu"]);
    fs::write(&secret, "another").unwrap();
    let output = send(&store.endpoint(), &secret);
    assert_eq!(output.status.code(), Some(1));
    assert!(complained(&output).contains("locked-out"), "{}", complained(&output));
}

/// Asks a server to stop, as a computer that is shut down does: killed while it writes, Ralph would leave a file that it cannot
/// read again.
fn stop(server: &mut std::process::Child) {
    let asked = Command::new("kill").arg(server.id().to_string()).status().unwrap();
    assert!(asked.success());
    server.wait().unwrap();
}

#[test]
fn ralph_gets_every_statement_once_though_it_is_stopped_half_way() {
    let Some(python) = tools::named_by("TYPODONT_RALPH", "a Python with the record store Ralph") else { return };
    let folder = folder("ralph");
    for n in 0..60 {
        enter(&folder, &session("5-grinding", &format!("student-{n:02}"), 40.0 + f64::from(n)));
    }
    let mut odd = session("5-grinding", "<script>alert(1)</script>", 70.0);
    odd["scenario"]["title"] = json!("مرحبا ".repeat(1000));
    enter(&folder, &odd);
    let spool = folder.join("spool");
    let output = typodont(&[
        "xapi",
        "make",
        &path(&folder),
        "--spool",
        &path(&spool),
        "--home-page",
        "https://school.example.edu",
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    let expected: BTreeSet<String> =
        statements_below(&spool.join("waiting")).iter().map(|s| s["id"].as_str().unwrap().into()).collect();

    let ralph =
        school::Ralph { python: PathBuf::from(python), folder: folder.join("ralph"), port: school::free_port() };
    let mut server = ralph.start();
    let program = env!("CARGO_BIN_EXE_typodont");
    let endpoint = format!("http://127.0.0.1:{}/xAPI", ralph.port);
    let sender = Command::new(program)
        .args(["xapi", "send", &path(&spool), "--endpoint", &endpoint, "--key", "station", "--patience", "120"])
        .env("TYPODONT_LRS_SECRET", "secret")
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let sent = || fs::read_dir(spool.join("sent")).unwrap().count();
    while sent() < 15 {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    stop(&mut server);
    let at_the_stop = sent();
    assert!(at_the_stop < 60, "it was stopped too late to prove anything");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let mut server = ralph.start();
    let output = sender.wait_with_output().unwrap();
    server.kill().unwrap();
    server.wait().unwrap();
    assert!(output.status.success(), "{}", complained(&output));

    let kept = ralph.kept();
    assert_eq!(kept.iter().cloned().collect::<BTreeSet<String>>(), expected);
    assert_eq!(kept.len(), expected.len(), "nothing is kept twice");
    println!("stopped after {at_the_stop} of 61 sessions; {} statements, each once", kept.len());
}

#[test]
fn python_reads_the_parquet_tables() {
    let folder = folder("parquet");
    for n in 0..20 {
        enter(&folder, &session("5-grinding", &format!("student-{n}"), 40.0 + f64::from(n)));
    }
    let mut bare = json!({ "version": 1, "scenario": { "id": "by-hand" }, "participant": hostile()[3], "metrics": { "dice": null } });
    bare["started"] = json!("no moment");
    enter(&folder, &bare);
    let tables = folder.join("tables");
    let output = typodont(&["parquet", &path(&folder), "-o", &path(&tables)]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(tables.join("events.parquet").is_file());
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python that reads Parquet") else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_parquet.py");
    let output = Command::new(python).arg(script).arg(&tables).arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
}
