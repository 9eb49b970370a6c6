//! Many stations, one database: every session arrives once and is scored once, and no login reads sessions of others.

use crate::support::cluster;
use crate::support::folder;
use crate::support::school;
use crate::support::tools;

use cluster::{Bucket, Cluster, complained, program};
use folder::folder;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use typodont_core::device::DeviceSpec;
use typodont_core::sim::Simulation;
use typodont_exercise::record::{Recorder, RecordingEndFile, RecordingHeadFile, ServoStatsFile};
use typodont_exercise::scenario::{self, ResolveMode, Workpiece};
use typodont_exercise::session::{Operator, OperatorFile, Session};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_string()
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes a bundle with valid digests, and a recording of this many bytes that cannot be scored.
fn enter(folder: &Path, name: &str, mut session: Value, bytes: usize) -> PathBuf {
    let bundle = folder.join(name);
    fs::create_dir_all(&bundle).unwrap();
    let mut mark = Sha256::digest(name).to_vec();
    while mark.len() < bytes {
        let next = Sha256::digest(&mark[mark.len() - 32..]);
        mark.extend_from_slice(&next);
    }
    mark.truncate(bytes);
    session["digests"] = json!({ "recording.mcap": sha256(&mark) });
    fs::write(bundle.join("recording.mcap"), mark).unwrap();
    fs::write(bundle.join("session.json"), session.to_string()).unwrap();
    bundle
}

/// A school with stations that may come in, and a class.
fn school_of(stations: &[&str]) -> Option<Cluster> {
    let cluster = Cluster::start()?;
    cluster.ask("owner", &["school", "class", "A"]);
    cluster.ask("owner", &["school", "class", "B"]);
    for station in stations {
        cluster.ask("owner", &["school", "admit", station, "--as", "station"]);
    }
    for role in ["registrar", "worker"] {
        cluster.ask("owner", &["school", "admit", role, "--as", role]);
    }
    cluster.ask("owner", &["school", "admit", "examiner", "--as", "examiner", "--class", "A"]);
    Some(cluster)
}

fn sync(cluster: &Cluster, station: &str, folder: &Path, store: &str, class: &str) -> String {
    cluster.ask(station, &["sync", &text(folder), "--class", class, "--store", store])
}

fn kill(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// Numbers that scatter, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }
}

/// Number of stations or sessions in the test below; an environment variable can raise it.
fn number(name: &str, usual: usize) -> usize {
    std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

#[test]
fn every_session_arrives_exactly_once_whatever_is_killed_on_the_way() {
    // Aim: bytes first, row last, once. Method: stations that are killed at any moment send at once while the database is stopped
    // as by a power cut and started again; then every row is compared with what the station has and the store holds.
    // TYPODONT_SESSIONS and TYPODONT_STATIONS make it larger.
    let (sessions, stations) = (number("TYPODONT_SESSIONS", 300), number("TYPODONT_STATIONS", 6));
    let names: Vec<String> = (0..stations).map(|n| format!("station-{n:02}")).collect();
    let Some(cluster) = school_of(&names.iter().map(String::as_str).collect::<Vec<_>>()) else { return };
    let folder = folder("stations");
    let store = folder.join("store");
    let address = format!("file://{}", store.display());
    for n in 0..sessions {
        let own = folder.join(&names[n % stations]);
        let mut one = school::session("5-grinding", &format!("student-{:03}", n % 97), (n % 100) as f64);
        one["started"] = json!(format!(
            "2026-{:02}-{:02}T{:02}:{:02}:{:02}Z",
            1 + n % 12,
            1 + n % 28,
            n / 3600 % 24,
            n / 60 % 60,
            n % 60
        ));
        enter(&own, &format!("bundle-{n:05}"), one, 20_000 + n % 7);
    }
    // One session lies at two stations: a copy on a stick.
    let twice = folder.join(&names[1]).join("copy");
    fs::create_dir_all(&twice).unwrap();
    for file in ["session.json", "recording.mcap"] {
        fs::copy(folder.join(&names[0]).join("bundle-00000").join(file), twice.join(file)).unwrap();
    }
    let begun = Instant::now();
    let sending = AtomicBool::new(true);
    let (kills, stops) = thread::scope(|scope| {
        let stops = scope.spawn(|| {
            let mut stops = 0;
            while sending.load(Ordering::Relaxed) {
                thread::sleep(Duration::from_millis(700));
                cluster.down();
                thread::sleep(Duration::from_millis(150));
                cluster.up();
                stops += 1;
            }
            stops
        });
        let senders: Vec<_> = names
            .iter()
            .enumerate()
            .map(|(n, name)| {
                let (cluster, folder, address) = (&cluster, &folder, &address);
                scope.spawn(move || {
                    let mut dice = Dice(n as u64 + 1);
                    let mut kills = 0;
                    let own = folder.join(name);
                    let most = 60 + 4 * (sessions / stations) as u64;
                    loop {
                        let mut child = cluster
                            .command(
                                name,
                                &["sync", &text(&own), "--class", "A", "--store", address, "--patience", "60"],
                            )
                            .stdout(Stdio::null())
                            .stderr(Stdio::null())
                            .spawn()
                            .unwrap();
                        let ends = Instant::now() + Duration::from_millis(30 + dice.below(most));
                        let status = loop {
                            match child.try_wait().unwrap() {
                                Some(status) => break Some(status),
                                None if kills < 8 && Instant::now() > ends => break None,
                                None => thread::sleep(Duration::from_millis(3)),
                            }
                        };
                        match status {
                            Some(status) => {
                                assert!(status.success(), "{name}: {status}");
                                return kills;
                            }
                            None => kill(&mut child),
                        }
                        kills += 1;
                    }
                })
            })
            .collect();
        let kills: usize = senders.into_iter().map(|s| s.join().unwrap()).sum();
        sending.store(false, Ordering::Relaxed);
        (kills, stops.join().unwrap())
    });
    let took = begun.elapsed();
    let count = |sql: &str| cluster.count(sql) as usize;
    assert_eq!(count("SELECT count(*) FROM typodont.session"), sessions, "none lost, none twice");
    assert_eq!(count("SELECT count(*) FROM typodont.metric_value"), 3 * sessions);
    assert_eq!(count("SELECT count(*) FROM typodont.rating"), 3 * sessions);
    assert_eq!(count("SELECT count(*) FROM typodont.participant"), sessions.min(97));
    assert_eq!(count("SELECT count(*) FROM typodont.audit WHERE action = 'session received'"), sessions);
    // Every part that a row names is there and is what it was, and nothing else is there.
    let mut stored = BTreeSet::new();
    for row in
        cluster.client("owner").query("SELECT manifest::text, bundle, station FROM typodont.session", &[]).unwrap()
    {
        let manifest: Value = serde_json::from_str(row.get(0)).unwrap();
        for (n, part) in manifest["parts"].as_array().unwrap().iter().enumerate() {
            let digest = part["sha256"].as_str().unwrap();
            let name = format!("{}/{n:05}-{digest}.tar-part", manifest["folder"].as_str().unwrap());
            assert_eq!(sha256(&fs::read(store.join(&name)).unwrap()), digest);
            stored.insert(name);
        }
    }
    assert_eq!(files_below(&store), stored);
    let _ = writeln!(
        std::io::stderr(),
        "{sessions} sessions of {stations} stations in {:.1} s: {kills} stations killed, {stops} stops of the database",
        took.as_secs_f64()
    );
    assert!(kills > 0 && stops > 0);
}

fn files_below(folder: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).into_iter().flatten().flatten() {
            match entry.path().is_dir() {
                true => open.push(entry.path()),
                // The word by which a store is known is nobody's file.
                false if entry.file_name() == "typodont-store" => {}
                false => drop(found.insert(text(entry.path().strip_prefix(folder).unwrap()))),
            }
        }
    }
    found
}

#[test]
fn parts_that_no_row_names_are_removed() {
    // Aim: nothing of a session lies in the store twice, or after its erasure. Method: the files that a station leaves when it is
    // killed while it writes the marker, after another station has entered its session, and after an erasure.
    let Some(cluster) = school_of(&["station-1", "station-2"]) else { return };
    let folder = folder("orphans");
    let store = folder.join("store");
    let address = format!("file://{}", store.display());
    let [own, copy] = ["own", "copy"].map(|name| folder.join(name));
    enter(&own, "bundle", school::session("5-grinding", "anna", 50.0), 20_000);
    enter(&copy, "bundle", school::session("5-grinding", "anna", 50.0), 20_000);
    assert!(sync(&cluster, "station-1", &own, &address, "A").starts_with("1 sessions sent"));
    let stored = files_below(&store);
    let part = stored.iter().next().unwrap();
    let leave_orphans = |name: &str| {
        let orphan = store.join(part.replacen("station-1", name, 1));
        fs::create_dir_all(orphan.parent().unwrap()).unwrap();
        fs::write(orphan, b"part").unwrap();
        fs::write(store.join("typodont-store#1"), b"half").unwrap();
    };
    leave_orphans("station-2");
    assert!(sync(&cluster, "station-2", &copy, &address, "A").contains("1 already stored"));
    assert_eq!(files_below(&store), stored);
    cluster.ask("registrar", &["school", "erase", "anna", "--store", &address]);
    assert_eq!(files_below(&store), BTreeSet::new());
    leave_orphans("station-1");
    assert!(sync(&cluster, "station-1", &own, &address, "A").contains("1 erased"));
    assert_eq!(files_below(&store), BTreeSet::new());
}

#[test]
fn a_file_goes_on_in_its_middle_after_a_kill() {
    // Aim: what is stored is not sent again. Method: a recording of six parts, the station killed after the first; the first part's
    // time is the same in the end. A part that was bent meanwhile is sent again.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("resumed");
    let store = folder.join("store");
    let own = folder.join("own");
    enter(&own, "bundle", school::session("5-grinding", "anna", 50.0), 45 << 20);
    let address = format!("file://{}", store.display());
    let mut child = cluster
        .command("station-1", &["sync", &text(&own), "--class", "A", "--store", &address])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let parts =
        || -> Vec<String> { files_below(&store).into_iter().filter(|name| name.ends_with(".tar-part")).collect() };
    while parts().len() < 2 {
        assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none(), "killed too late");
        thread::sleep(Duration::from_millis(1));
    }
    kill(&mut child);
    let before = parts();
    assert!(before.len() < 6, "killed too late to prove anything");
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 0, "the row comes last");
    let time = |name: &str| fs::metadata(store.join(name)).unwrap().modified().unwrap();
    let first = time(&before[0]);
    let bent = store.join(&before[1]);
    let mut bytes = fs::read(&bent).unwrap();
    bytes[17] ^= 1;
    fs::write(&bent, bytes).unwrap();
    assert!(sync(&cluster, "station-1", &own, &address, "A").starts_with("1 sessions sent"));
    assert_eq!(parts().len(), 6);
    assert_eq!(time(&before[0]), first);
    for name in parts() {
        assert!(name.contains(&sha256(&fs::read(store.join(&name)).unwrap())), "{name}");
    }
    // The parts are an archive that comes back whole.
    let back = folder.join("back");
    cluster.ask("registrar", &["school", "fetch", &text(&back), "--store", &address]);
    let fetched = fs::read_dir(&back).unwrap().next().unwrap().unwrap().path();
    for file in ["session.json", "recording.mcap"] {
        assert!(fs::read(fetched.join(file)).unwrap() == fs::read(own.join("bundle").join(file)).unwrap());
    }
}

#[test]
fn bundles_go_to_a_store_that_speaks_s3() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let Some(bucket) = Bucket::start() else { return };
    let folder = folder("s3");
    let own = folder.join("own");
    for n in 0..12 {
        let size = if n == 0 { 20 << 20 } else { 5000 };
        enter(&own, &format!("bundle-{n}"), school::session("5-grinding", &format!("student-{n}"), 50.0), size);
    }
    let run = |login: &str, arguments: &[&str], secret: &str| {
        let mut command = cluster.command(login, arguments);
        bucket.known_to(&mut command);
        command.env("AWS_SECRET_ACCESS_KEY", secret).output().unwrap()
    };
    let arguments = ["sync", &text(&own), "--class", "A"];
    let output = run("station-1", &arguments, "secret");
    assert!(output.status.success(), "{}", complained(&output));
    assert_eq!(bucket.objects(), 11 + 3 + 1, "a part for each small bundle, three for the large one, the store's word");
    let output = run("station-1", &arguments, "secret");
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("0 sessions sent, 12 already stored"));
    let back = folder.join("back");
    let output = run("registrar", &["school", "fetch", &text(&back)], "secret");
    assert!(output.status.success(), "{}", complained(&output));
    assert_eq!(files_below(&back).len(), 24);
    let output = run("registrar", &["school", "erase", "student-0"], "secret");
    assert!(output.status.success(), "{}", complained(&output));
    assert_eq!(bucket.objects(), 11 + 1);
    // A store beyond this machine is not spoken to in the clear, and keys stand in no complaint.
    let mut command =
        cluster.command("registrar", &["school", "fetch", &text(&folder.join("never")), "--patience", "1"]);
    bucket.known_to(&mut command);
    let output =
        command.env("AWS_ENDPOINT", "http://192.0.2.7:9000").env("AWS_SECRET_ACCESS_KEY", "hunter2").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complained(&output).contains("plain-http") && !complained(&output).contains("hunter2"),
        "{}",
        complained(&output)
    );
}

/// Somebody who grinds a coarse tooth on and on, until the time is over: the exercise, and their operator file.
fn grinder(folder: &Path) -> [PathBuf; 2] {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let mut scenario: Value = serde_json::from_str(&fs::read_to_string(source).unwrap()).unwrap();
    scenario["stages"][0]["time_limit_s"] = json!(number("TYPODONT_SECONDS", 1));
    let all = scenario["stages"].as_array_mut().unwrap();
    all.truncate(1);
    let cut = json!({ "press_n": 1.5, "patience_s": 0.5, "speed_mm_s": 5, "pitch_mm": 0.3, "margin_mm": 0.0, "lean_mm": 4.0,
        "passes": 1, "until_cleared_pct": 100 });
    let follow = json!({ "press_n": 0.5, "speed_mm_s": 5, "lines": 6 });
    let operator = json!({ "id": "grinder", "title": "Grinds on", "hand": { "speed_mm_s": 40, "tremor_mm": 0.02 }, "agrees": 3,
        "rules": [{ "when": "always", "do": [{ "take": "bur" }, { "cut": cut }, { "follow": follow }], "repeat": true }] });
    let files = ["grinding.json", "grinder.json"].map(|name| folder.join(name));
    fs::write(&files[0], scenario.to_string()).unwrap();
    fs::write(&files[1], operator.to_string()).unwrap();
    files
}

/// Bundles of real recordings, one for each session: they differ in when they began.
fn recorded(folder: &Path, count: usize) -> Vec<PathBuf> {
    let [exercise, grinder] = grinder(folder);
    let mut library = Library::shipped();
    library.insert(OperatorFile::file_name("grinder"), fs::read(grinder).unwrap());
    let operator = OperatorFile::read(&library, "grinder").unwrap();
    let source = SourceText::new("grinding.json", fs::read_to_string(exercise).unwrap());
    let scenario = Arc::new(scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap());
    let workpiece = Arc::new(Workpiece::make(&scenario, 1).unwrap());
    let spec = DeviceSpec::phantom_omni();
    (0..count)
        .map(|n| {
            let bundle = folder.join("own").join(format!("bundle-{n:05}"));
            fs::create_dir_all(&bundle).unwrap();
            let recording = bundle.join("recording.mcap");
            let head = RecordingHeadFile {
                participant: "somebody".into(),
                started: format!(
                    "2026-10-{:02}T{:02}:{:02}:{:02}Z",
                    1 + n / 86_400,
                    n / 3600 % 24,
                    n / 60 % 60,
                    n % 60
                ),
                operator: Some(operator.id.clone()),
                ..RecordingHeadFile::of(&scenario, &spec, 1)
            };
            let mut recorder = Recorder::create(&recording, &head, &scenario, &workpiece).unwrap();
            let mut session = Session::new(scenario.clone(), &workpiece);
            let setup = typodont_exercise::session::setup(&scenario, &workpiece, spec.clone());
            let mut simulation = Simulation::new(setup);
            let mut trainee = Operator::new(operator.clone(), scenario.clone(), workpiece.clone(), spec.clone(), 1);
            typodont_exercise::session::run(&mut session, &mut simulation, &mut trainee, &mut recorder).unwrap();
            let servo = ServoStatsFile::of(&simulation);
            recorder.finish(&RecordingEndFile { reason: "complete".into(), servo }).unwrap();
            let digests = format!("\"recording.mcap\": \"{}\"", sha256(&fs::read(&recording).unwrap()));
            let scored = scored_by_hand(&recording);
            assert!(scored.ends_with("\"digests\": {}\n}\n"));
            let scored = scored.replace("\"digests\": {}", &format!("\"digests\": {{\n    {digests}\n  }}"));
            fs::write(bundle.join("session.json"), scored).unwrap();
            bundle
        })
        .collect()
}

fn scored_by_hand(bundle: &Path) -> String {
    let output = Command::new(program()).args(["score", &text(bundle)]).output().unwrap();
    assert!(output.status.success(), "{}", complained(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn workers_that_are_killed_score_every_session_once_and_to_the_last_bit() {
    // Aim: leases, retries and one result per session and version. Method: workers of which one is killed again and again; then one
    // result each, equal to what `typodont score` prints. A recording that nobody can score is set aside and holds nothing up.
    // TYPODONT_RECORDINGS, TYPODONT_SECONDS, TYPODONT_WORKERS and TYPODONT_KILL_MS make it larger.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("workers");
    let count = number("TYPODONT_RECORDINGS", 12);
    let bundles = recorded(&folder, count);
    let own = folder.join("own");
    enter(&own, "poison", school::session("5-grinding", "berk", 50.0), 3000);
    let address = format!("file://{}", folder.join("store").display());
    sync(&cluster, "station-1", &own, &address, "A");
    let enqueue = ["enqueue", "--scorer", "current"];
    assert!(cluster.ask("registrar", &enqueue).starts_with(&format!("{} sessions queued", count + 1)));
    assert!(cluster.ask("registrar", &enqueue).starts_with("0 sessions"), "asking twice asks once");
    let start = || {
        let arguments = ["worker", "--drain", "--lease", "2", "--attempts", "50", "--store", &address];
        let mut command = cluster.command("worker", &arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut workers: Vec<Child> = (0..number("TYPODONT_WORKERS", 3)).map(|_| start()).collect();
    let mut kills = 0;
    // One dies whenever two sessions more are done, so that a slow machine gets on as well; by hand by the clock.
    let pause = Duration::from_millis(number("TYPODONT_KILL_MS", 0) as u64);
    let begun = Instant::now();
    let (mut done_then, mut killed) = (0, begun);
    loop {
        // Asking is work as well, which a measurement is not to see.
        thread::sleep((pause / 20).clamp(Duration::from_millis(20), Duration::from_millis(500)));
        let of = |state: &str| cluster.count(&format!("SELECT count(*) FROM typodont.job WHERE state IN ({state})"));
        let waiting = of("'waiting', 'leased'");
        if waiting == 0 {
            break;
        }
        let done = of("'done'");
        let is_time = if pause.is_zero() { done >= done_then + 2 } else { killed.elapsed() >= pause };
        if is_time {
            let turn = kills % workers.len();
            kill(&mut workers[turn]);
            workers[turn] = start();
            (kills, done_then, killed) = (kills + 1, done, Instant::now());
        }
        assert!(begun.elapsed() < Duration::from_secs(36_000), "{waiting} wait");
    }
    let took = begun.elapsed();
    workers.iter_mut().for_each(kill);
    assert!(kills > 0 || took < pause);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.job WHERE state = 'done'") as usize, count);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.score") as usize, count);
    let rows = cluster
        .client("owner")
        .query(
            "SELECT s.bundle, k.result, k.agrees FROM typodont.score k JOIN typodont.session s ON s.id = k.session_id",
            &[],
        )
        .unwrap();
    let expected: BTreeMap<String, String> = bundles
        .iter()
        .map(|bundle| (bundle.file_name().unwrap().to_str().unwrap().to_string(), scored_by_hand(bundle)))
        .collect();
    for row in &rows {
        let name = row.get::<_, String>(0);
        assert_eq!(row.get::<_, String>(1), expected[&name], "{name}");
        assert_eq!(row.get::<_, Option<bool>>(2), Some(true));
    }
    let aside = cluster
        .client("owner")
        .query_one("SELECT attempts, error FROM typodont.job WHERE state = 'set aside'", &[])
        .unwrap();
    assert!(
        aside.get::<_, String>(1).contains("unreadable") || aside.get::<_, String>(1).contains("recording"),
        "{aside:?}"
    );
    let taken = cluster.count("SELECT sum(attempts) FROM typodont.job");
    let _ = writeln!(
        std::io::stderr(),
        "{count} recordings in {:.1} s, {kills} workers killed, {taken} attempts",
        took.as_secs_f64()
    );
    // The same from a folder, without a database: every share once, and the same bits.
    let out = folder.join("rescored");
    fs::remove_dir_all(own.join("poison")).unwrap();
    for number in 1..=3 {
        let share = format!("{number}/3");
        let output = Command::new(program())
            .args(["rescore", &text(&own), "--shard", &share, "--out", &text(&out)])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", complained(&output));
    }
    let files = files_below(&out);
    assert_eq!(files.len(), count);
    let rescored: BTreeSet<String> = files.iter().map(|file| fs::read_to_string(out.join(file)).unwrap()).collect();
    assert_eq!(rescored, expected.into_values().collect());
}

#[test]
fn a_worker_ends_gracefully_and_counts_for_prometheus() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("graceful");
    recorded(&folder, 2);
    let address = format!("file://{}", folder.join("store").display());
    sync(&cluster, "station-1", &folder.join("own"), &address, "A");
    cluster.ask("worker", &["enqueue", "--scorer", "current"]);
    let mut worker = cluster
        .command("worker", &["worker", "--store", &address, "--metrics", "0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while cluster.count("SELECT count(*) FROM typodont.job WHERE state = 'done'") < 2 {
        assert!(begun.elapsed() < Duration::from_secs(120));
        thread::sleep(Duration::from_millis(50));
    }
    let mut line = String::new();
    let mut told = std::io::BufReader::new(worker.stderr.take().unwrap());
    std::io::BufRead::read_line(&mut told, &mut line).unwrap();
    let port: u16 =
        line.trim().strip_prefix("http://127.0.0.1:").unwrap().strip_suffix("/metrics").unwrap().parse().unwrap();
    thread::sleep(Duration::from_millis(1200));
    let mut stream = std::net::TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut page = String::new();
    stream.read_to_string(&mut page).unwrap();
    assert!(
        page.contains("\ntypodont_sessions_scored_total 2\n") && page.contains("typodont_jobs{state=\"done\"} 2"),
        "{page}"
    );
    assert!(Command::new("kill").args(["-TERM", &worker.id().to_string()]).status().unwrap().success());
    let output = worker.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("2 scored, 0 failed"));
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.job WHERE state = 'leased'"), 0);
}

#[test]
fn a_disk_that_is_not_mounted_is_no_empty_store() {
    // Aim: a worker or an erasure with a wrong store does nothing at all, and says so. Method: the same commands with a folder that
    // looks like a store before its disk is there; then with the right one.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("unmounted");
    recorded(&folder, 2);
    let [right, wrong] = ["store", "mount"].map(|name| format!("file://{}", folder.join(name).display()));
    sync(&cluster, "station-1", &folder.join("own"), &right, "A");
    cluster.ask("worker", &["enqueue", "--scorer", "current"]);
    let refused = |login: &str, arguments: &[&str]| {
        let output = cluster.typodont(login, &[arguments, &["--store", &wrong]].concat());
        let said = complained(&output);
        assert!(output.status.code() == Some(1) && said.contains("wrong-store") && said.contains("mounted"), "{said}");
    };
    refused("worker", &["worker", "--drain"]);
    refused("registrar", &["school", "erase", "somebody"]);
    refused("registrar", &["school", "retain"]);
    refused("station-1", &["sync", &text(&folder.join("own")), "--class", "A"]);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.job WHERE state = 'waiting'"), 2);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 2);
    // An object that is gone is looked for again: it may be the disk.
    let parts = files_below(&folder.join("store"));
    let lost = folder.join("store").join(parts.iter().next().unwrap());
    fs::rename(&lost, folder.join("lost")).unwrap();
    let mut worker =
        cluster.command("worker", &["worker", "--drain", "--store", &right]).stdout(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while cluster.count("SELECT count(*) FROM typodont.job WHERE attempts > 1") == 0 {
        assert!(begun.elapsed() < Duration::from_secs(120), "it is not tried again");
        thread::sleep(Duration::from_millis(50));
    }
    fs::rename(folder.join("lost"), &lost).unwrap();
    assert!(worker.wait().unwrap().success());
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.job WHERE state = 'done'"), 2);
}

/// Text of this many letters that does not compress, as an index of the database would like.
fn scattered(letters: usize) -> String {
    let mut dice = Dice(7);
    (0..letters).map(|_| char::from(b'!' + dice.below(90) as u8)).filter(|c| !"\"\\".contains(*c)).collect()
}

#[test]
fn a_text_that_is_too_long_for_the_records_holds_up_no_other_session() {
    // Aim: one odd bundle costs one bundle. Method: texts of 12 000 letters where the records have an index, each in a bundle
    // between good ones. Regression: SQLSTATE 54000 once ended the station's sync, each time anew.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("too_long");
    let (own, long) = (folder.join("own"), scattered(12_000));
    let mut poisoned = Vec::new();
    for (n, pointer) in ["/participant", "/scenario/id", "/scenario/sha256"].iter().enumerate() {
        let mut one = school::session("5-grinding", "berk", 50.0);
        *one.pointer_mut(pointer).unwrap() = json!(long);
        poisoned.push(enter(&own, &format!("b{n}-poison"), one, 500));
    }
    let mut one = school::session("5-grinding", "berk", 50.0);
    one["metrics"][long.as_str()] = json!(1.5);
    poisoned.push(enter(&own, "b3-poison", one, 500));
    for n in 0..5 {
        enter(&own, &format!("b{n}-sound"), school::session("5-grinding", &format!("student-{n}"), 50.0), 500);
    }
    let address = format!("file://{}", folder.join("store").display());
    let output = cluster.typodont("station-1", &["sync", &text(&own), "--class", "A", "--store", &address]);
    let told = complained(&output);
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("5 sessions sent"), "{output:?}");
    for bundle in &poisoned {
        assert!(told.contains(&text(bundle)), "{told}");
    }
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 5);
    assert_eq!(files_below(&folder.join("store")).len(), 5, "nothing of the refused ones is left");
    // The records themselves refuse it, whatever a station lets through: about this session, and not for good.
    let mut client = cluster.client("station-1");
    let error = client.query_one("SELECT typodont.exercise_of($1, 'id', 'title')", &[&long]).unwrap_err();
    assert!(typodont_school::records::is_data_error(&error) && !typodont_school::records::is_transient(&error));
}

#[test]
fn admitting_a_login_takes_nobodys_password() {
    // Aim: a slip of the pen costs nobody the database. Method: the owner, a superuser, logins beyond the rules about rows, and a
    // registrar under a station's name; then the same with the word that is asked for.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("admitted");
    let secret = folder.join("secret");
    fs::write(&secret, "hunter2 and more\n").unwrap();
    cluster
        .client("owner")
        .batch_execute(
            "ALTER ROLE owner PASSWORD 'own'; CREATE ROLE dba LOGIN SUPERUSER; CREATE ROLE reader LOGIN BYPASSRLS;
             CREATE ROLE staff; CREATE ROLE heir LOGIN IN ROLE owner; CREATE ROLE maker LOGIN CREATEROLE;
             CREATE ROLE copier LOGIN REPLICATION; ALTER ROLE registrar PASSWORD 'reg'",
        )
        .unwrap();
    let passwords = || -> Vec<(String, Option<String>)> {
        let sql = "SELECT rolname::text, rolpassword FROM pg_authid WHERE rolname NOT LIKE 'pg\\_%' ORDER BY 1";
        cluster.client("owner").query(sql, &[]).unwrap().iter().map(|row| (row.get(0), row.get(1))).collect()
    };
    let members = "SELECT count(*) FROM pg_auth_members";
    let (before, members_before) = (passwords(), cluster.count(members));
    let admit = |login: &str, more: &[&str]| {
        let fixed = ["school", "admit", login, "--as", "station"];
        cluster.typodont("owner", &[&fixed, more].concat())
    };
    let with_password = ["--password-file", &text(&secret)];
    let replacing = ["--password-file", &text(&secret), "--replace"];
    for login in ["owner", "dba", "reader", "heir", "maker", "copier", "staff"] {
        for more in [&[][..], &with_password, &replacing] {
            let output = admit(login, more);
            assert_eq!(output.status.code(), Some(1), "{login}: {}", complained(&output));
            assert!(complained(&output).contains("wrong-login"), "{login}: {}", complained(&output));
        }
    }
    let output = admit("registrar", &with_password);
    assert!(output.status.code() == Some(1) && complained(&output).contains("--replace"), "{}", complained(&output));
    assert_eq!(admit("pg_read_all_data", &[]).status.code(), Some(2));
    assert_eq!((passwords(), cluster.count(members)), (before.clone(), members_before), "nothing was changed");
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.audit WHERE detail LIKE 'owner as%'"), 0);
    // Asked for, it is done; and what a login may do is printed.
    assert_eq!(String::from_utf8_lossy(&admit("registrar", &replacing).stdout), "registrar: registrar, station\n");
    assert_ne!(passwords(), before);
    assert_eq!(String::from_utf8_lossy(&admit("station-2", &with_password).stdout), "station-2: station\n");
}

#[test]
fn a_worker_changes_measures_only_with_a_score_of_its_own() {
    // Aim: a worker's login is no way to lose or forge measures unseen. Method: what a curious worker would try, before and after
    // it has entered a score; what it may do is in the audit log.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("measures");
    let own = folder.join("own");
    for n in 0..3 {
        enter(&own, &format!("b{n}"), school::session("5-grinding", &format!("student-{n}"), 50.0), 500);
    }
    sync(&cluster, "station-1", &own, &format!("file://{}", folder.join("store").display()), "A");
    let measures = "SELECT count(*) FROM typodont.metric_value";
    let lines = "SELECT count(*) FROM typodont.audit WHERE action = 'measures removed' AND session_id IS NOT NULL";
    let before = cluster.count(measures);
    let (id, version): (String, i64) = {
        let row =
            cluster.client("owner").query_one("SELECT min(id::text), min(scorer_version) FROM typodont.session", &[]);
        row.map(|row| (row.get(0), row.get(1))).unwrap()
    };
    let mut worker = cluster.client("worker");
    let removed = |worker: &mut postgres::Client| worker.execute("DELETE FROM typodont.metric_value", &[]).unwrap();
    assert_eq!(removed(&mut worker), 0);
    let insert = format!("INSERT INTO typodont.metric_value VALUES ('{id}', {version}, 'made_up', 1)");
    assert!(worker.batch_execute(&insert).is_err());
    // Neither in somebody else's name nor at another time.
    for (column, value) in [("scored_by", "'station-1'"), ("scored_at", "now() + interval '1 day'")] {
        let score = format!(
            "INSERT INTO typodont.score (session_id, scorer_version, result, typodont_version, {column})
             VALUES ('{id}', {version}, '{{}}', 'x', {value})"
        );
        assert!(worker.batch_execute(&score).is_err(), "{column}");
    }
    assert_eq!((cluster.count(measures), cluster.count(lines)), (before, 0));
    // With its score it replaces the measures of that session and version; afterwards they stand.
    let mut transaction = worker.transaction().unwrap();
    let score = format!(
        "INSERT INTO typodont.score (session_id, scorer_version, result, typodont_version) VALUES ('{id}', {version}, '{{}}', 'x')"
    );
    transaction.batch_execute(&score).unwrap();
    assert_eq!(transaction.execute("DELETE FROM typodont.metric_value", &[]).unwrap(), 3);
    transaction.batch_execute(&insert).unwrap();
    transaction.commit().unwrap();
    assert_eq!(removed(&mut worker), 0);
    assert!(worker.batch_execute(&insert.replace("made_up", "more")).is_err());
    assert_eq!((cluster.count(measures), cluster.count(lines)), (before - 2, 1));
    let audit = cluster.ask("registrar", &["school", "audit"]);
    let line = audit.lines().find(|line| line.contains("measures removed")).unwrap();
    assert!(line.contains("\"worker\"") && line.contains(&id) && line.contains("3 of scorer version"), "{line}");
    // An erasure is one line of its own, and takes the measures with it.
    cluster.ask(
        "registrar",
        &["school", "erase", "student-1", "--store", &format!("file://{}", folder.join("store").display())],
    );
    assert_eq!(cluster.count(&format!("{measures} WHERE session_id NOT IN (SELECT id FROM typodont.session)")), 0);
}

#[test]
fn nobody_is_erased_or_noted_by_a_slip() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("slips");
    let own = folder.join("own");
    enter(&own, "one", school::session("5-grinding", "ada", 70.0), 500);
    let address = format!("file://{}", folder.join("store").display());
    sync(&cluster, "station-1", &own, &address, "A");
    let erase = |code: &str| cluster.typodont("registrar", &["school", "erase", code, "--store", &address]);
    assert_eq!(erase("").status.code(), Some(2));
    let output = erase("adda");
    assert!(output.status.code() == Some(1) && complained(&output).contains("unknown-participant"));
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.erased"), 0, "a slip of the pen bans nobody");
    cluster.ask("registrar", &["school", "erase", "adda", "--unsent", "--store", &address]);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.erased"), 1);
    // Sent, and then written anew: what was sent counts, and the station is told.
    let session = own.join("one/session.json");
    let forged = fs::read_to_string(&session).unwrap().replace("70.0", "100.0");
    fs::write(&session, &forged).unwrap();
    let output = cluster.typodont("station-1", &["sync", &text(&own), "--class", "A", "--store", &address]);
    assert!(complained(&output).contains("changed"), "{}", complained(&output));
    // The audit log cannot be made to say what nobody did.
    let forged = cluster.client("station-1").batch_execute("SELECT typodont.note('erased', '9 sessions')");
    assert!(forged.is_err());
    let output = cluster.typodont("owner", &["school", "admit", "typodont_worker", "--as", "station"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(cluster.typodont("owner", &["school", "class", "bad name"]).status.code(), Some(2));
    let output = cluster.typodont("registrar", &["enqueue", "--scorer", "current", "--class", "nope"]);
    assert!(output.status.code() == Some(1) && complained(&output).contains("unknown-class"));
}

#[test]
fn nobody_reads_what_is_not_theirs() {
    // Aim: the roles, by trying. Method: two stations, an examiner of another class, and every sentence a curious person would try.
    let Some(cluster) = school_of(&["station-1", "station-2"]) else { return };
    let folder = folder("roles");
    let address = format!("file://{}", folder.join("store").display());
    for (station, class, person) in [("station-1", "A", "anna"), ("station-2", "B", "berk")] {
        let own = folder.join(station);
        enter(&own, person, school::session("5-grinding", person, 50.0), 500);
        sync(&cluster, station, &own, &address, class);
    }
    let seen = |login: &str, sql: &str| -> Result<i64, String> {
        let row = cluster.client(login).query_one(sql, &[]);
        row.map(|row| row.get(0)).map_err(|e| e.as_db_error().unwrap().message().to_string())
    };
    let of = |table: &str| format!("SELECT count(*) FROM typodont.{table}");
    // A station sees its own, and of nobody else that there is anybody.
    assert_eq!(seen("station-1", &of("session")), Ok(1));
    assert_eq!(seen("station-1", &of("metric_value")), Ok(3));
    assert_eq!(seen("station-1", &of("rating")), Ok(3));
    assert_eq!(
        seen("station-1", "SELECT count(*) FROM typodont.session WHERE station <> 'station-1' OR result LIKE '%berk%'"),
        Ok(0)
    );
    for table in
        ["participant", "score", "override", "examiner_rating", "job", "export", "audit", "erased", "salt", "examines"]
    {
        assert!(seen("station-1", &of(table)).unwrap_err().contains("permission denied"), "{table}");
    }
    let refused = |login: &str, sql: &str| {
        let error = cluster.client(login).batch_execute(sql).unwrap_err();
        let told = error.as_db_error().unwrap().message().to_string();
        assert!(told.contains("permission denied") || told.contains("row-level security"), "{login}: {sql}: {told}");
    };
    refused("station-1", "UPDATE typodont.session SET points = 100");
    refused("station-1", "DELETE FROM typodont.session");
    refused("station-1", "SELECT typodont.erase_participant('berk')");
    refused("station-1", "SELECT typodont.digest('participant', 'berk')");
    refused("station-1", "SET ROLE typodont_registrar; SELECT * FROM typodont.session");
    let forged = |station: &str, folder: &str| {
        format!(
            "INSERT INTO typodont.session (id, station, class_id, exercise_id, bundle, ended_because, length_s, scorer_version, result, manifest)
             SELECT gen_random_uuid(), '{station}', c.id, e.id, 'x', '', 1, 1, '{{}}', '{{\"folder\": \"{folder}\"}}'
             FROM typodont.class c, typodont.exercise e LIMIT 1"
        )
    };
    refused("station-1", &forged("station-2", "station-2/x"));
    refused("station-1", &forged("station-1", "station-2/x"));
    refused("station-1", "INSERT INTO typodont.metric_value SELECT gen_random_uuid(), 1, 'dice', 1");
    // A session stays as it was sent: nothing can be added later.
    refused(
        "station-1",
        "INSERT INTO typodont.metric_value SELECT id, scorer_version, 'made_up', 1 FROM typodont.session",
    );
    refused("station-1", "INSERT INTO typodont.rating SELECT id, 'q', 99, 'i', 'c', 1, 1 FROM typodont.session");
    // A bundle's name leads nowhere.
    for name in ["/srv/other", "..", "a/../../b", "a\\b"] {
        let sql = format!(
            "INSERT INTO typodont.session (id, class_id, exercise_id, bundle, ended_because, length_s, scorer_version, result, manifest)
             SELECT g.id, c.id, e.id, '{name}', '', 1, 1, '{{}}', json_build_object('folder', 'station-1/' || g.id)
             FROM typodont.class c, typodont.exercise e, (SELECT gen_random_uuid() AS id) g LIMIT 1"
        );
        let error = cluster.client("station-1").batch_execute(&sql).unwrap_err();
        assert!(error.as_db_error().unwrap().message().contains("session_bundle_check"), "{name}: {error:?}");
    }
    // An examiner reads a class and judges there; its people, and no others.
    assert_eq!(seen("examiner", &of("session")), Ok(1));
    assert_eq!(seen("examiner", "SELECT count(*) FROM typodont.participant WHERE code = 'anna'"), Ok(1));
    assert_eq!(seen("examiner", "SELECT count(*) FROM typodont.participant WHERE code = 'berk'"), Ok(0));
    assert_eq!(seen("examiner", &of("metric_value")), Ok(3));
    refused("examiner", "UPDATE typodont.session SET points = 100");
    // Nor does a line about one's own session judge another's.
    let id = |person: &str| -> String {
        let sql = "SELECT s.id::text FROM typodont.session s JOIN typodont.participant p ON p.id = s.participant_id
          WHERE p.code = $1";
        cluster.client("owner").query_one(sql, &[&person]).unwrap().get(0)
    };
    for (number, about) in [(1i64, "anna"), (2, "berk")] {
        let line = judgement(&id(about), "2026-11-22T09:00:00Z", 99.0).to_string();
        let sql = "INSERT INTO typodont.override (log, number, session_id, line, sha256)
          SELECT 'by hand', $1, id, $2, '' FROM typodont.session WHERE id::text = $3";
        cluster.client("examiner").execute(sql, &[&number, &line, &id("anna")]).unwrap();
    }
    let told = typodont_school::records::read_overrides(&mut cluster.client("registrar")).unwrap();
    let about: Vec<&str> = told.valid_entries().map(|entry| entry.draft.session.as_str()).collect();
    assert_eq!(about, [id("anna").as_str()]);
    refused("examiner", "SELECT * FROM typodont.audit");
    refused("examiner", "SELECT typodont.erase_sessions('{}', 'x')");
    // A registrar reads all and changes no grade; a worker does not learn who it was; nobody rewrites the audit log.
    assert_eq!(seen("registrar", &of("session")), Ok(2));
    refused("registrar", "UPDATE typodont.session SET points = 100");
    refused("registrar", "DELETE FROM typodont.audit");
    refused("registrar", "UPDATE typodont.metric_value SET value = 1");
    assert_eq!(seen("worker", &of("session")), Ok(2));
    refused("worker", "SELECT * FROM typodont.participant");
    refused("worker", "DELETE FROM typodont.session");
    let output = cluster.typodont(
        "station-1",
        &["parquet", "--database", &cluster.address("station-1"), "-o", &text(&folder.join("no"))],
    );
    assert!(complained(&output).contains("permission denied"), "{}", complained(&output));
    let output = cluster.typodont("station-1", &["school", "audit"]);
    assert!(complained(&output).contains("permission denied"), "{}", complained(&output));
    assert!(cluster.ask("registrar", &["school", "audit"]).contains("session received"));
}

#[test]
fn sql_in_every_text_is_only_text() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("hostile");
    let address = format!("file://{}", folder.join("store").display());
    let own = folder.join("own");
    let hostile = [
        "'; DROP TABLE typodont.session; --",
        "\"; DELETE FROM typodont.job; --",
        "$$; SELECT pg_sleep(9); $$",
        "\\'; COPY typodont.session TO PROGRAM 'id'; --",
        "%s%n{0}$1 \u{202e}مرحبا 🦷",
    ];
    for (n, evil) in hostile.iter().enumerate() {
        let mut one = school::session(evil, evil, 50.0);
        for pointer in [
            "/scenario/title",
            "/scenario/sha256",
            "/ended_because",
            "/typodont_version",
            "/questionnaire/id",
            "/questionnaire/items/0/id",
            "/questionnaire/items/0/category",
        ] {
            *one.pointer_mut(pointer).unwrap() = json!(evil);
        }
        one["metrics"][*evil] = json!(1.5);
        enter(&own, &format!("{n} '; DROP TABLE typodont.session; --"), one, 500);
    }
    // Letters that no database takes are refused, and hold nothing up.
    enter(&own, "zero", school::session("5-grinding", "a\0b", 50.0), 500);
    let output = cluster.typodont("station-1", &["sync", &text(&own), "--class", "A", "--store", &address]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&output.stdout)
            .starts_with("5 sessions sent, 0 already stored, 0 erased by the school, 1 refused"),
        "{output:?}"
    );
    let rows = cluster.client("owner").query("SELECT p.code, e.name, s.ended_because FROM typodont.session s JOIN typodont.participant p ON p.id = s.participant_id JOIN typodont.exercise e ON e.id = s.exercise_id", &[]).unwrap();
    let codes: BTreeSet<String> = rows.iter().map(|row| row.get(0)).collect();
    assert_eq!(codes, hostile.iter().map(|evil| evil.to_string()).collect());
    assert!(
        rows.iter().all(|row| row.get::<_, String>(0) == row.get::<_, String>(1)
            && row.get::<_, String>(0) == row.get::<_, String>(2))
    );
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.metric_value WHERE value = 1.5"), 5);
    for evil in hostile {
        let refused = |login: &str, arguments: &[&str]| {
            let output = cluster.typodont(login, arguments);
            assert!(!output.status.success(), "{arguments:?}");
        };
        refused("owner", &["school", "class", evil]);
        refused("owner", &["school", "admit", evil, "--as", "station"]);
        refused("owner", &["school", "admit", "x", "--as", "examiner", "--class", evil]);
        refused("station-1", &["sync", &text(&own), "--class", evil, "--store", &address]);
        refused("registrar", &["cohort", "--class", evil]);
        assert!(cluster.ask("registrar", &["school", "erase", evil, "--store", &address]).starts_with("1 sessions"));
    }
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 0);
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.participant"), 0);
}

#[test]
fn who_is_erased_is_found_nowhere() {
    // Aim: records, store, exports and logs without a trace of a person, and the others as before. Method: a code that stands nowhere
    // else is looked for in the dump, in every file of store and export, and in the server's log; Parquet is not compressed.
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("erased");
    let (own, store, tables) = (folder.join("own"), folder.join("store"), folder.join("tables"));
    let address = format!("file://{}", store.display());
    let code = "zq-unmistakable-7";
    for n in 0..6 {
        let person = if n % 2 == 0 { code.to_string() } else { format!("student-{n}") };
        let mut one = school::session("5-grinding", &person, 50.0);
        one["started"] = json!(format!("2026-0{}-01T10:00:00Z", 1 + n / 2));
        enter(&own, &format!("bundle-{n}"), one, 700);
    }
    // Alone in its month.
    let mut one = school::session("5-grinding", code, 50.0);
    one["started"] = json!("2026-09-01T10:00:00Z");
    enter(&own, "bundle-9", one, 700);
    sync(&cluster, "station-1", &own, &address, "A");
    let database = cluster.address("registrar");
    cluster.ask("registrar", &["parquet", "--database", &database, "-o", &text(&tables)]);
    let holds = |place: &Path| {
        let has = |file: &String| fs::read(place.join(file)).unwrap().windows(code.len()).any(|w| w == code.as_bytes());
        files_below(place).iter().filter(|file| has(file)).count()
    };
    let parts = files_below(&tables).len();
    assert!(
        cluster.dump().contains(code) && holds(&store) == 4 && holds(&tables) == 4,
        "the search finds what is there"
    );
    let foretold = cluster.ask("registrar", &["school", "erase", code, "--dry-run"]);
    assert!(foretold.starts_with("4 sessions") && foretold.contains(&text(&tables)), "{foretold}");
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 7);
    let told = cluster.ask("registrar", &["school", "erase", code, "--store", &address]);
    assert!(told.starts_with("4 sessions erased") && told.contains("was rewritten"), "{told}");
    // Both the time and the code of what is gone.
    assert!(
        !cluster.dump().contains(code),
        "{}",
        cluster.dump().lines().find(|l| l.contains(code)).unwrap_or_default()
    );
    assert_eq!((holds(&store), holds(&tables)), (0, 0));
    assert!(!fs::read_to_string(cluster.log()).unwrap_or_default().contains(code));
    assert_eq!(files_below(&store).len(), 3);
    assert_eq!(files_below(&tables).len(), parts - 3, "a month of nobody else is gone");
    assert_eq!(cluster.count("SELECT count(*) FROM typodont.session"), 3);
    assert_eq!(
        cluster
            .count("SELECT count(*) FROM typodont.audit WHERE action = 'session received' AND session_id IS NOT NULL"),
        3
    );
    // A station that has them still does not bring them back, and can be told to delete them.
    let output = cluster.typodont("station-1", &["sync", &text(&own), "--class", "A", "--store", &address]);
    assert!(
        String::from_utf8_lossy(&output.stdout)
            .starts_with("0 sessions sent, 3 already stored, 4 erased by the school"),
        "{output:?}"
    );
    let mut late = school::session("5-grinding", code, 99.0);
    late["started"] = json!("2026-10-01T10:00:00Z");
    enter(&own, "late", late, 700);
    cluster.ask("station-1", &["sync", &text(&own), "--class", "A", "--store", &address, "--remove-erased"]);
    assert_eq!(holds(&own), 0);
    assert!(!cluster.dump().contains(code));

    // An export that is not here any more is named until somebody says that it was dealt with.
    fs::rename(&tables, folder.join("moved")).unwrap();
    let output = cluster.typodont("registrar", &["school", "erase", "student-1", "--store", &address]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complained(&output).contains(&text(&tables)), "{}", complained(&output));
    cluster.ask("registrar", &["school", "erase", "--done", &text(&tables)]);
    // Sessions that their class no longer keeps are erased in the same way.
    cluster.ask("owner", &["school", "class", "A", "--keep-days", "3650"]);
    assert!(cluster.ask("registrar", &["school", "retain", "--dry-run"]).starts_with("0 sessions"));
    cluster
        .client("owner")
        .batch_execute("UPDATE typodont.session SET started_at = now() - interval '11 years' WHERE bundle = 'bundle-3'")
        .unwrap();
    // An export that was dealt with is listed again when it contains another participant; a deleted one is not.
    let output = cluster.typodont("registrar", &["school", "retain", "--store", &address]);
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("1 sessions erased"));
    assert!(output.status.code() == Some(1) && complained(&output).contains(&text(&tables)), "{}", complained(&output));
    cluster.ask("registrar", &["school", "erase", "--gone", &text(&tables)]);
    cluster.ask("registrar", &["school", "retain", "--store", &address]);
    assert_eq!((files_below(&store).len(), cluster.count("SELECT count(*) FROM typodont.session")), (1, 1));
}

#[test]
fn a_cohort_is_the_same_from_a_folder_and_from_the_database() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("same");
    let own = folder.join("own");
    let address = format!("file://{}", folder.join("store").display());
    for n in 0..30 {
        enter(
            &own,
            &format!("bundle-{n:02}"),
            school::session("5-grinding", &format!("student-{}", n % 11), 40.0 + f64::from(n)),
            500,
        );
    }
    // A whole one, with maps and words.
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
    fs::create_dir_all(own.join("example/views")).unwrap();
    for file in files_below(&example) {
        fs::copy(example.join(&file), own.join("example").join(&file)).unwrap();
    }
    sync(&cluster, "station-1", &own, &address, "A");
    // In a folder the recording is replayed; in the database a result is verified when a worker has come to the same.
    cluster.ask("registrar", &["enqueue", "--scorer", "current"]);
    cluster.typodont("worker", &["worker", "--drain", "--attempts", "1", "--store", &address]);
    let outputs = |source: &[&str], name: &str| {
        let file = |kind: &str| text(&folder.join(format!("{name}.{kind}")));
        let (csv, json, html, grades) = (file("csv"), file("json"), file("html"), file("grades"));
        let printed = cluster.ask(
            "examiner",
            &[&["cohort"], source, &["--csv", &csv, "--json", &json, "--html", &html, "--expert", "example"]].concat(),
        );
        cluster.ask("examiner", &[&["gradebook"], source, &["--for", "moodle", "--overrides", "-o", &grades]].concat());
        (printed, [csv, json, grades].map(|path| fs::read_to_string(path).unwrap()))
    };
    let by_folder = outputs(&[&text(&own)], "folder");
    let database = cluster.address("examiner");
    let by_database = outputs(&["--database", &database, "--store", &address], "database");
    assert_eq!(by_folder.0, by_database.0);
    // What cannot be replayed is not verified in either; the reason is seen in the folder, and by the worker.
    let [damaged, waiting] =
        ["recording.mcap: damaged-recording: not an MCAP file", "the recording has not been replayed yet"];
    for (a, b) in by_folder.1.iter().zip(&by_database.1) {
        assert_eq!(&a.replace(damaged, waiting), b);
    }
    let nothing = cluster.typodont("examiner", &["cohort", "--database", &database, "--class", "B"]);
    assert!(complained(&nothing).contains("no-sessions"));
}

#[test]
fn python_reads_the_partitions() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("partitions");
    let (own, tables) = (folder.join("own"), folder.join("tables"));
    let address = format!("file://{}", folder.join("store").display());
    for n in 0..40 {
        let class = ["A", "B"][n % 2];
        let mut one = school::session("5-grinding", &format!("student-{n}"), 40.0 + n as f64);
        one["started"] = json!(if n == 7 { "no moment".into() } else { format!("2026-{:02}-15T10:00:00Z", 1 + n % 5) });
        enter(&own.join(class), &format!("bundle-{n:02}"), one, 300);
    }
    for class in ["A", "B"] {
        sync(&cluster, "station-1", &own.join(class), &address, class);
    }
    cluster.ask("registrar", &["parquet", "--database", &cluster.address("registrar"), "-o", &text(&tables)]);
    assert!(tables.join("sessions/class=A/month=2026-01/sessions.parquet").is_file());
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python that reads Parquet") else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_partitions.py");
    let output = Command::new(python).arg(script).arg(&tables).arg(&own).output().unwrap();
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), complained(&output));
}

/// The first line of an examiner's log: the whole grade of a session is judged otherwise.
fn judgement(session: &str, at: &str, points: f64) -> Value {
    json!({ "version": 1, "number": 1, "previous": "0".repeat(64), "at": at, "session": session, "recording": "",
        "item": null, "machine": { "points": 50.0, "passed": false }, "examiner": { "points": points, "passed": true },
        "reason": "'; DROP TABLE typodont.override; --", "name": "Dr. Öz" })
}

#[test]
fn what_examiners_judged_is_entered_and_counts() {
    let Some(cluster) = school_of(&["station-1"]) else { return };
    let folder = folder("judged");
    let own = folder.join("own");
    let address = format!("file://{}", folder.join("store").display());
    enter(&own, "bundle", school::session("5-grinding", "anna", 50.0), 500);
    sync(&cluster, "station-1", &own, &address, "A");
    let id: String = cluster.client("owner").query_one("SELECT id::text FROM typodont.session", &[]).unwrap().get(0);
    let line = judgement(&id, "2026-11-22T09:00:00Z", 88.0);
    fs::write(own.join("overrides.jsonl"), line.to_string() + "\n").unwrap();
    assert!(cluster.ask("examiner", &["school", "judgements", &text(&own)]).contains("1 overrides uploaded"));
    assert!(cluster.ask("examiner", &["school", "judgements", &text(&own)]).contains("0 overrides uploaded"));
    let grades = folder.join("grades.csv");
    let database = cluster.address("registrar");
    cluster.ask(
        "registrar",
        &["gradebook", "--database", &database, "--for", "moodle", "--overrides", "-o", &text(&grades)],
    );
    assert!(fs::read_to_string(grades).unwrap().contains("anna,88,"));
    // At another desk it is taken over, once, and the log holds.
    let desk = folder.join("desk");
    cluster.ask("examiner", &["school", "fetch", &text(&desk), "--store", &address]);
    assert!(
        cluster.ask("examiner", &["school", "judgements", &text(&desk)]).contains("0 overrides uploaded, 1 downloaded")
    );
    assert!(
        cluster.ask("examiner", &["school", "judgements", &text(&desk)]).contains("0 overrides uploaded, 0 downloaded")
    );
    // Judged at a third desk since, and entered later: the older word does not overrule it there, and the newer one counts.
    let late = folder.join("late");
    fs::create_dir_all(&late).unwrap();
    fs::write(late.join("overrides.jsonl"), judgement(&id, "2026-11-22T10:30:00Z", 60.0).to_string() + "\n").unwrap();
    let exchanged = cluster.ask("examiner", &["school", "judgements", &text(&late)]);
    assert!(exchanged.contains("1 overrides uploaded, 0 downloaded"), "{exchanged}");
    let grades = folder.join("grades-later.csv");
    cluster.ask(
        "registrar",
        &["gradebook", "--database", &database, "--for", "moodle", "--overrides", "-o", &text(&grades)],
    );
    assert!(fs::read_to_string(grades).unwrap().contains("anna,60,"));
    // Ratings travel in the same way, and an earlier one does not follow a later one of the same examiner.
    let rating = |at: &str, overall: u8, blind: bool| {
        json!({ "version": 1, "number": 1, "previous": "0".repeat(64), "at": at, "session": id, "recording": "",
            "scale": 5, "overall": overall, "items": [], "blind": blind, "note": "'; DROP TABLE x; --", "name": "Dr. Öz" })
    };
    fs::write(own.join("ratings.jsonl"), rating("2026-11-22T09:00:00Z", 2, false).to_string() + "\n").unwrap();
    fs::write(late.join("ratings.jsonl"), rating("2026-11-22T10:00:00Z", 4, false).to_string() + "\n").unwrap();
    let exchange = |folder: &Path| cluster.ask("examiner", &["school", "judgements", &text(folder)]);
    assert!(exchange(&own).contains("1 ratings uploaded, 0 downloaded"));
    assert!(exchange(&own).contains("0 ratings uploaded, 0 downloaded"));
    assert!(exchange(&desk).contains("0 ratings uploaded, 1 downloaded"));
    assert!(exchange(&late).contains("1 ratings uploaded, 0 downloaded"));
    assert!(exchange(&desk).contains("0 ratings uploaded, 1 downloaded"));
    let counting = |folder: &Path| {
        let log = typodont_review::RatingLog::of(folder).read(None).unwrap();
        assert!(log.issues.is_empty(), "{:?}", log.issues);
        log.counting(&id).iter().map(|entry| entry.draft.overall).collect::<Vec<_>>()
    };
    assert_eq!((counting(&desk), counting(&late)), (vec![Some(4)], vec![Some(4)]));
    let received = "SELECT count(*) FROM typodont.audit WHERE action = 'rating received' AND session_id IS NOT NULL";
    assert_eq!(cluster.count(received), 2);
    // Of a class that is not theirs examiners enter nothing.
    cluster.ask("owner", &["school", "admit", "other", "--as", "examiner", "--class", "B"]);
    let other = cluster.ask("other", &["school", "judgements", &text(&own)]);
    assert!(other.contains("0 overrides uploaded, 0 downloaded; 0 ratings uploaded, 0 downloaded"), "{other}");
}

#[test]
fn secrets_stand_in_no_command_and_no_complaint() {
    let folder = folder("secrets");
    let never = |arguments: &[&str]| {
        let output = Command::new(program()).args(arguments).env_remove("TYPODONT_DATABASE").output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", complained(&output));
        assert!(!complained(&output).contains("hunter2"), "{}", complained(&output));
    };
    never(&["school", "init", "--database", "postgres://a:hunter2@localhost/b"]);
    never(&["school", "init", "--database", "host=localhost user=a password=hunter2"]);
    never(&["school", "init"]);
    never(&["worker", "--database", "postgres://a@localhost/b", "--store", "s3://key:hunter2@bucket/x"]);
    never(&["worker", "--database", "postgres://a@localhost/b", "--store", "ftp://bucket"]);
    let Some(cluster) = school_of(&["station-1"]) else { return };
    // A password from a file, kept by the server as no more than a verifier.
    let secret = folder.join("secret");
    fs::write(&secret, "hunter2 and more\n").unwrap();
    cluster.ask("owner", &["school", "admit", "station-9", "--as", "station", "--password-file", &text(&secret)]);
    let kept: String = cluster
        .client("owner")
        .query_one("SELECT rolpassword FROM pg_authid WHERE rolname = 'station-9'", &[])
        .unwrap()
        .get(0);
    assert!(kept.starts_with("SCRAM-SHA-256$"), "{kept}");
    let rules = "local all owner trust\nlocal all all scram-sha-256\n";
    let file = cluster.folder.join("data/pg_hba.conf");
    fs::write(&file, rules).unwrap();
    cluster.client("owner").batch_execute("SELECT pg_reload_conf()").unwrap();
    thread::sleep(Duration::from_millis(500));
    let own = folder.join("own");
    enter(&own, "bundle", school::session("5-grinding", "anna", 50.0), 500);
    let address = format!("file://{}", folder.join("store").display());
    let arguments = ["sync", &text(&own), "--class", "A", "--store", &address, "--patience", "2"];
    let mut with = cluster.command("station-9", &arguments);
    let output = with.env("TYPODONT_DATABASE_PASSWORD_FILE", &secret).output().unwrap();
    assert!(output.status.success(), "{}", complained(&output));
    fs::write(&secret, "hunter3").unwrap();
    let output =
        cluster.command("station-9", &arguments).env("TYPODONT_DATABASE_PASSWORD_FILE", &secret).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complained(&output).contains("refused") && !complained(&output).contains("hunter"),
        "{}",
        complained(&output)
    );
    assert!(!fs::read_to_string(cluster.log()).unwrap_or_default().contains("hunter"));
}

#[test]
fn a_database_under_tls_is_believed_by_its_certificate_alone() {
    // Aim: whoever asks for TLS gets it, with the server's name and authority checked. Method: a server with a certificate of the
    // tests' own authority, asked with that authority, with the usual ones, and under a name that is not in the certificate.
    let Some(cluster) = Cluster::start() else { return };
    let Some((port, authority)) = cluster.up_with_tls() else { return };
    let ask = |host: &str, more: &[&str]| {
        let address = format!("postgres://owner@{host}:{port}/school?sslmode=require");
        let fixed = ["school", "init", "--database", &address, "--patience", "1"];
        Command::new(program()).args([&fixed, more].concat()).output().unwrap()
    };
    let believed = ["--database-certificates", &text(&authority)];
    let output = ask("localhost", &believed);
    assert!(output.status.success(), "{}", complained(&output));
    for output in [ask("localhost", &[]), ask("127.0.0.1", &believed)] {
        assert_eq!(output.status.code(), Some(1));
        assert!(complained(&output).contains("certificate"), "{}", complained(&output));
    }
}

#[test]
fn nothing_of_it_touches_a_single_user() {
    // Aim: no port, no connection, no other program. Method: the calls that would make one, counted while a folder is worked on.
    if Command::new("strace").arg("-V").output().is_err() {
        return tools::skip("there is no strace: calls to the network are not counted");
    }
    let folder = folder("alone");
    enter(&folder, "bundle", school::session("5-grinding", "anna", 50.0), 500);
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
    for arguments in
        [vec!["cohort".to_string(), text(&folder)], vec!["score".into(), text(&example)], vec!["--version".into()]]
    {
        let calls = folder.join("calls.txt");
        let output = Command::new("strace")
            .args(["-f", "-e", "trace=socket,connect,bind,listen,execve", "-o", &text(&calls), &program()])
            .args(&arguments)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", complained(&output));
        let calls = fs::read_to_string(&calls).unwrap();
        let made: Vec<&str> = calls.lines().filter(|line| line.contains('(')).collect();
        assert_eq!(made.len(), 1, "{arguments:?} starts itself and nothing else:\n{calls}");
    }
}
