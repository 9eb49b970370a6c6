//! Import circles: files of a crate that need each other cannot be read one at a time.

use super::sources::{SourceFile, sources};
use regex_lite::Regex;
use std::collections::{BTreeMap, BTreeSet};

/// Files in the largest circle that is allowed without a reason.
const CIRCLE_MAX: usize = 3;

/// Larger circles: a file of each, the number of its files, and the reason.
const ALLOWED: [(&str, usize, &str); 0] = [];

type Module = Vec<String>;

/// Paths that a `use` tree names: `a::{b, c::d}` gives `a::b` and `a::c::d`. `as` names are left out.
fn use_paths(tree: &str) -> Vec<Vec<String>> {
    let mut depth = 0;
    let mut branch = String::new();
    let mut branches = Vec::new();
    for letter in tree.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                branches.push(std::mem::take(&mut branch));
                continue;
            }
            _ => {}
        }
        branch.push(letter);
    }
    branches.push(branch);
    let mut paths = Vec::new();
    for branch in branches.iter().map(|branch| branch.trim()).filter(|branch| !branch.is_empty()) {
        match branch.split_once('{') {
            Some((prefix, inner)) => {
                let prefix: Vec<String> =
                    prefix.split("::").map(|part| part.trim().to_string()).filter(|part| !part.is_empty()).collect();
                let inner = inner.trim_end().strip_suffix('}').unwrap_or(inner);
                paths.extend(use_paths(inner).into_iter().map(|path| [prefix.clone(), path].concat()));
            }
            None => {
                let path = branch.split(" as ").next().unwrap_or_default();
                paths.push(path.split("::").map(|part| part.trim().to_string()).collect());
            }
        }
    }
    paths
}

/// The files of one crate, by module, with what each re-exports and names.
struct Crate {
    modules: BTreeSet<Module>,
    /// By module and exported name, the path that it stands for.
    reexports: BTreeMap<(Module, String), Vec<String>>,
    uses: BTreeMap<Module, Vec<Vec<String>>>,
}

impl Crate {
    fn of(files: &[&SourceFile]) -> Crate {
        let declaration = Regex::new(r"(pub(?:\([^)]*\))?\s+)?\buse\s+([^;]+);").unwrap();
        let inline = Regex::new(r"\b(?:crate|super|self)(?:::\w+)+").unwrap();
        let path = Regex::new(r"\b\w+(?:::\w+)+").unwrap();
        let modules: BTreeSet<Module> = files.iter().map(|file| file.module.clone()).collect();
        let mut found = Crate { modules, reexports: BTreeMap::new(), uses: BTreeMap::new() };
        for file in files {
            let code = file.code();
            let mut uses = Vec::new();
            for tree in declaration.captures_iter(&code) {
                for path in use_paths(&tree[2]) {
                    match tree.get(1) {
                        Some(_) => {
                            let name = path.last().cloned().unwrap_or_default();
                            found.reexports.insert((file.module.clone(), name), path);
                        }
                        None => uses.push(path),
                    }
                }
            }
            let body = declaration.replace_all(&code, "");
            let split = |path: &str| path.split("::").map(str::to_string).collect::<Vec<_>>();
            uses.extend(inline.find_iter(&body).map(|path| split(path.as_str())));
            uses.extend(path.find_iter(&body).map(|path| split(path.as_str())));
            found.uses.insert(file.module.clone(), uses);
        }
        found
    }

    /// The file that a path leads to, seen from a module; `None` for other crates.
    fn resolve(&self, from: &Module, path: &[String], depth: u32) -> Option<Module> {
        if depth > 8 {
            return None;
        }
        let mut rest = path;
        let child = |module: &Module, name: &String| {
            let inner = [module.as_slice(), std::slice::from_ref(name)].concat();
            self.modules.contains(&inner).then_some(inner)
        };
        let mut at = match rest.first()?.as_str() {
            "crate" => Vec::new(),
            "self" => from.clone(),
            "super" => from[..from.len().checked_sub(1)?].to_vec(),
            _ => {
                child(from, &rest[0])?;
                return self.descend(from.clone(), path, depth);
            }
        };
        rest = &rest[1..];
        while rest.first().is_some_and(|part| part == "super") {
            at = at[..at.len().checked_sub(1)?].to_vec();
            rest = &rest[1..];
        }
        self.descend(at, rest, depth)
    }

    fn descend(&self, mut at: Module, mut rest: &[String], depth: u32) -> Option<Module> {
        while let Some(name) = rest.first() {
            let inner = [at.as_slice(), std::slice::from_ref(name)].concat();
            if self.modules.contains(&inner) {
                at = inner;
                rest = &rest[1..];
                continue;
            }
            if let Some(target) = self.reexports.get(&(at.clone(), name.clone())) {
                let target = [target.as_slice(), &rest[1..]].concat();
                if let Some(found) = self.resolve(&at, &target, depth + 1) {
                    return Some(found);
                }
            }
            break;
        }
        Some(at)
    }

    /// Imports by file. What a submodule takes from a module that holds it does not count: they are one room.
    fn imports(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let mut imports = BTreeMap::new();
        for (module, uses) in &self.uses {
            let targets = uses.iter().filter_map(|path| self.resolve(module, path, 0));
            let counts = |target: &Module| target != module && !module.starts_with(target);
            imports.insert(module.clone(), targets.filter(counts).collect());
        }
        imports
    }
}

/// Every file that can be reached from `start`.
fn reachable(imports: &BTreeMap<Module, BTreeSet<Module>>, start: &Module) -> BTreeSet<Module> {
    let mut seen = BTreeSet::new();
    let mut open = vec![start.clone()];
    while let Some(module) = open.pop() {
        for next in imports.get(&module).into_iter().flatten() {
            if seen.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    seen
}

#[test]
fn no_circle_of_imports_is_large() {
    // Aim: a file can be understood with those below it. Method: resolve every `use` and path inside a crate, through
    // re-exports, and look for files that reach each other.
    let files = sources();
    let crates: BTreeSet<&str> = files.iter().map(|file| file.krate.as_str()).collect();
    let mut wrong = Vec::new();
    let mut edges = 0;
    for krate in crates {
        let own: Vec<&SourceFile> = files.iter().filter(|file| file.krate == krate).collect();
        let imports = Crate::of(&own).imports();
        edges += imports.values().map(BTreeSet::len).sum::<usize>();
        let reach: BTreeMap<&Module, BTreeSet<Module>> =
            imports.keys().map(|module| (module, reachable(&imports, module))).collect();
        let mut done = BTreeSet::new();
        for (module, reached) in &reach {
            let circle: BTreeSet<&Module> =
                reached.iter().filter(|other| reach.get(other).is_some_and(|back| back.contains(*module))).collect();
            if circle.len() <= CIRCLE_MAX || !done.insert(circle.clone()) {
                continue;
            }
            let names: Vec<String> = circle.iter().map(|module| format!("{krate}/{}", module.join("/"))).collect();
            let allowed =
                ALLOWED.iter().any(|(file, size, _)| names.iter().any(|name| name == file) && names.len() <= *size);
            if !allowed {
                wrong.push(format!("{} files: {}", names.len(), names.join(", ")));
            }
        }
    }
    assert!(edges > 500, "only {edges} imports were found");
    assert!(wrong.is_empty(), "files that import each other in a circle:\n{}", wrong.join("\n"));
}

#[test]
fn what_is_drawn_is_known_only_to_the_application() {
    // Aim: the state of the window can be read, tested and carried into a page without its screens. Method: who imports
    // `ui` of the crate `app`.
    let files = sources();
    let own: Vec<&SourceFile> = files.iter().filter(|file| file.krate == "app").collect();
    let imports = Crate::of(&own).imports();
    let of = |module: &Module, folder: &str| module.first().is_some_and(|first| first == folder);
    let drawing = |targets: &BTreeSet<Module>| targets.iter().any(|target| of(target, "ui"));
    let importers: Vec<&Module> =
        imports.iter().filter(|(_, targets)| drawing(targets)).map(|(from, _)| from).collect();
    assert!(importers.iter().any(|from| of(from, "app")), "the application draws its screens");
    let wrong: Vec<_> = importers.iter().filter(|from| !of(from, "app") && !of(from, "ui")).collect();
    assert!(wrong.is_empty(), "only `app` may use the screens: {wrong:?}");
}

#[test]
fn a_screen_only_reads_the_state_that_it_shows() {
    // Aim: each change of state is a command, carried out in one place. Method: no function of `ui` takes the state of a
    // screen to change it.
    let changed = Regex::new(
        r"&mut (LessonState|LessonScene|EditorState|PreviewState|ExerciseList|LessonResults|KioskExit|OverlayState|String)\b",
    );
    let changed = changed.unwrap();
    let files = sources();
    let screens: Vec<&SourceFile> =
        files.iter().filter(|file| file.krate == "app" && file.path.contains("/ui/")).collect();
    assert!(screens.len() > 20, "{} files of screens", screens.len());
    let wrong: Vec<_> = screens.iter().filter(|file| changed.is_match(&file.text)).map(|file| &file.path).collect();
    assert!(wrong.is_empty(), "screens that change state themselves: {wrong:?}");
}
