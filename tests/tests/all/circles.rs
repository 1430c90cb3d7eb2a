//! The files of a crate stand in an order: none uses, by way of others, itself. Each is a module that somebody declares, and a constant
//! has one meaning.

use super::folders::{root, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// `use path as name;`, one of each name in braces; `*` for all.
#[derive(Default)]
struct Import {
    path: Vec<String>,
    name: String,
    exported: bool,
}

/// A module: a file, or a part of one.
#[derive(Default)]
struct Module {
    file: PathBuf,
    parent: usize,
    children: BTreeMap<String, usize>,
    defined: BTreeSet<String>,
    /// Names and values of its constants, those of types and functions left out.
    constants: Vec<(String, String)>,
    imports: Vec<Import>,
    /// Paths of two and more names in its code, those of imports included.
    paths: Vec<Vec<String>>,
}

impl Module {
    fn offers(&self, name: &str) -> bool {
        self.defined.contains(name) || self.children.contains_key(name) || self.imports.iter().any(|i| i.exported && i.name == name)
    }
}

/// Names, `::`, literals in quotes and single characters of a source, without comments.
fn tokens(text: &str) -> Vec<String> {
    let c: Vec<char> = text.chars().collect();
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut all, mut i) = (Vec::new(), 0);
    let after = |from: usize, end: &[char]| (from..c.len()).find(|&k| c[k..].starts_with(end)).map_or(c.len(), |k| k + end.len());
    while i < c.len() {
        let raw = c[i..].iter().skip(1).take_while(|c| **c == '#').count();
        match c[i] {
            '/' if c.get(i + 1) == Some(&'/') => i = after(i, &['\n']),
            '/' if c.get(i + 1) == Some(&'*') => i = after(i + 2, &['*', '/']),
            'r' if c.get(i + 1 + raw) == Some(&'"') && (i == 0 || !word(c[i - 1]) || c[i - 1] == 'b') => {
                let from = i + 1 + raw;
                i = after(from + 1, &[&['"'][..], &vec!['#'; raw]].concat());
                all.push(c[from..i].iter().collect());
            }
            '"' => {
                let from = i;
                i += 1;
                while i < c.len() && c[i] != '"' {
                    i += if c[i] == '\\' { 2 } else { 1 };
                }
                i = (i + 1).min(c.len());
                all.push(c[from..i].iter().collect());
            }
            '\'' if c.get(i + 1) == Some(&'\\') => i = after(i + 3, &['\'']),
            '\'' if c.get(i + 2) == Some(&'\'') => i += 3,
            first if word(first) => {
                let from = i;
                i += c[i..].iter().take_while(|c| word(**c)).count();
                all.push(c[from..i].iter().collect());
            }
            ':' if c.get(i + 1) == Some(&':') => {
                i += 2;
                all.push("::".into());
            }
            other => {
                i += 1;
                if !other.is_whitespace() {
                    all.push(other.into());
                }
            }
        }
    }
    all
}

/// Place after the item that begins here: behind its semicolon or its body, attributes first.
fn item_end(t: &[String], mut i: usize) -> usize {
    let (mut depth, mut import) = (0, false);
    while i < t.len() {
        import |= t[i] == "use" && depth == 0;
        match t[i].as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        i += 1;
        if depth == 0 && (t[i - 1] == ";" || t[i - 1] == "}" && !import) {
            break;
        }
    }
    i
}

/// The imports of one tree behind `use`, up to its end; returns the place of what follows.
fn import_tree(t: &[String], mut i: usize, before: &[String], into: &mut Vec<Import>) -> usize {
    let mut path = before.to_vec();
    while i < t.len() {
        match t[i].as_str() {
            "{" => {
                i += 1;
                while i < t.len() && t[i] != "}" {
                    i = import_tree(t, i, &path, into);
                    i += usize::from(t[i] == ",");
                }
                return i + 1;
            }
            "as" => {
                into.push(Import { path, name: t[i + 1].clone(), ..Import::default() });
                return i + 2;
            }
            "," | "}" | ";" => break,
            "::" => {}
            name => path.push(name.to_owned()),
        }
        i += 1;
    }
    match path.last().map(String::as_str) {
        Some("self") => drop(path.pop()),
        Some("*") => {
            path.pop();
            into.push(Import { path, name: "*".into(), ..Import::default() });
            return i;
        }
        _ => {}
    }
    if let Some(name) = path.last().cloned() {
        into.push(Import { path, name, ..Import::default() });
    }
    i
}

/// Where the sources of `mod name;` in a file may be.
fn places(file: &Path, name: &str) -> [PathBuf; 2] {
    let folder = file.parent().unwrap_or(Path::new(""));
    let stem = file.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
    let folder = if ["mod", "lib", "main"].contains(&stem) { folder.to_path_buf() } else { folder.join(stem) };
    [folder.join(format!("{name}.rs")), folder.join(name).join("mod.rs")]
}

/// All modules of one crate, its root first.
struct Crate {
    modules: Vec<Module>,
    tests: bool,
}

impl Crate {
    /// From its root file; `read` gives the text of a file that is there. With its test modules or without.
    fn read(root: &Path, tests: bool, read: &dyn Fn(&Path) -> Option<String>) -> Self {
        let mut all = Self { modules: vec![Module { file: root.to_path_buf(), ..Module::default() }], tests };
        all.file(0, read);
        all
    }

    fn add(&mut self, parent: usize, name: &str, file: PathBuf) -> usize {
        let new = self.modules.len();
        self.modules.push(Module { file, parent, ..Module::default() });
        self.modules[parent].children.insert(name.to_owned(), new);
        new
    }

    fn file(&mut self, module: usize, read: &dyn Fn(&Path) -> Option<String>) {
        let t = tokens(&read(&self.modules[module].file).unwrap_or_default());
        let is = |i: usize, text: &[&str]| text.iter().enumerate().all(|(k, w)| t.get(i + k).is_some_and(|t| t == w));
        // Modules that are open, and the depth of braces where each began.
        let (mut open, mut depth, mut i) = (vec![(module, 0)], 0, 0);
        while i < t.len() {
            let (at, from) = open[open.len() - 1];
            let next = t.get(i + 1).map_or("", String::as_str);
            match t[i].as_str() {
                "#" if !self.tests && is(i, &["#", "[", "cfg", "(", "test", ")", "]"]) => {
                    i = item_end(&t, i + 7);
                    continue;
                }
                "mod" if is(i + 2, &["{"]) => {
                    let file = self.modules[at].file.clone();
                    open.push((self.add(at, next, file), depth));
                    i += 2;
                    depth += 1;
                }
                "mod" if is(i + 2, &[";"]) => {
                    let file = places(&self.modules[at].file, next).into_iter().find(|p| read(p).is_some());
                    if let Some(file) = file {
                        let new = self.add(at, next, file);
                        self.file(new, read);
                    }
                }
                "use" if next != "<" => {
                    let mut new = Vec::new();
                    let exported = i > 0 && ["pub", ")"].contains(&t[i - 1].as_str());
                    i = import_tree(&t, i + 1, &[], &mut new);
                    let m = &mut self.modules[at];
                    m.paths.extend(new.iter().map(|n| n.path.clone()));
                    m.imports.extend(new.into_iter().map(|n| Import { exported, ..n }));
                    continue;
                }
                "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union" if depth == from + usize::from(at != module) => {
                    let m = &mut self.modules[at];
                    m.defined.insert(next.to_owned());
                    if t[i] == "const" && is(i + 2, &[":"]) && next != "_" && !(i > 0 && ["<", ","].contains(&t[i - 1].as_str())) {
                        let item = t[i..item_end(&t, i)].join(" ");
                        m.constants.push((next.to_owned(), item.split_once(" = ").map_or("", |(_, value)| value).to_owned()));
                    }
                }
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    if open.len() > 1 && depth == from {
                        open.pop();
                    }
                }
                _ if next == "::" && !(i > 0 && (t[i - 1] == "::" || t[i - 1] == "in" && t[i - 2] == "(")) => {
                    let mut path = vec![t[i].clone()];
                    while is(i + 1, &["::"]) && t.get(i + 2).is_some_and(|n| n.starts_with(|c: char| c.is_alphabetic() || c == '_')) {
                        i += 2;
                        path.push(t[i].clone());
                    }
                    self.modules[at].paths.push(path);
                }
                _ => {}
            }
            i += 1;
        }
    }

    /// Module in which what a path names is written, through whatever exports it again; none: in another crate.
    fn home(&self, at: usize, path: &[String], moved: bool, fuel: usize) -> Option<usize> {
        let Some((name, rest)) = path.split_first() else { return Some(at) };
        let m = &self.modules[at];
        match name.as_str() {
            "crate" => return self.home(0, rest, true, fuel),
            "self" => return self.home(at, rest, true, fuel),
            "super" => return self.home(m.parent, rest, true, fuel),
            _ => {}
        }
        if let Some(child) = m.children.get(name) {
            return self.home(*child, rest, true, fuel);
        }
        if m.defined.contains(name) || fuel == 0 {
            return moved.then_some(at);
        }
        if let Some(import) = m.imports.iter().find(|i| i.name == *name && i.path[..] != [name.clone()]) {
            return self.home(at, &[&import.path[..], rest].concat(), false, fuel - 1);
        }
        let through = m.imports.iter().filter(|i| i.name == "*").filter_map(|i| self.home(at, &i.path, false, fuel - 1));
        through.filter(|t| self.modules[*t].offers(name)).find_map(|t| self.home(t, path, true, fuel - 1)).or(moved.then_some(at))
    }

    /// Which file uses which other. A file and the modules that it declares itself are one thing.
    fn uses(&self) -> BTreeMap<&Path, BTreeSet<&Path>> {
        let mut all: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
        for (at, m) in self.modules.iter().enumerate() {
            for to in m.paths.iter().filter_map(|p| self.home(at, p, false, 8)) {
                let used = &self.modules[to];
                let declares = self.modules[used.parent].file == m.file && to != 0;
                if used.file != m.file && !declares {
                    all.entry(&m.file).or_default().insert(&used.file);
                }
            }
        }
        all
    }

    /// Files that use each other, directly or by way of others: each group once.
    fn circles(&self) -> BTreeSet<Vec<&Path>> {
        let uses = self.uses();
        let all: BTreeMap<&Path, BTreeSet<&Path>> = uses.keys().map(|f| (*f, reached(&uses, f))).collect();
        let groups = all.iter().map(|(f, r)| r.iter().copied().filter(|g| all.get(g).is_some_and(|r| r.contains(f))).collect());
        groups.filter(|g: &Vec<&Path>| g.len() > 1).collect()
    }
}

/// Constants of a crate that have one name and several values, and where.
fn ambiguous(of: &Crate) -> Vec<String> {
    let mut known: BTreeMap<&str, Vec<(&str, &Path)>> = BTreeMap::new();
    for m in &of.modules {
        m.constants.iter().for_each(|(name, value)| known.entry(name).or_default().push((value, &m.file)));
    }
    known.retain(|_, all| all.iter().any(|(value, _)| *value != all[0].0));
    known
        .iter()
        .map(|(name, all)| format!("{name}: {}", all.iter().map(|(_, f)| f.display().to_string()).collect::<Vec<_>>().join(" ")))
        .collect()
}

/// Files that one uses, and those which they use.
fn reached<'a>(uses: &BTreeMap<&'a Path, BTreeSet<&'a Path>>, from: &'a Path) -> BTreeSet<&'a Path> {
    let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(file) = next.pop() {
        next.extend(uses.get(file).into_iter().flatten().copied().filter(|f| seen.insert(*f)));
    }
    seen
}

/// A crate of these files, its root first.
fn made_of(files: &[(&str, &str)]) -> Crate {
    let read = |p: &Path| files.iter().find(|(name, _)| Path::new(name) == p).map(|(_, text)| (*text).to_owned());
    Crate::read(Path::new(files[0].0), false, &read)
}

fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let all = made_of(files);
    let names = |circle: Vec<&Path>| circle.iter().map(|f| f.to_str().expect("a name")).collect::<Vec<_>>().join(" ");
    all.circles().into_iter().map(names).collect()
}

#[test]
fn a_circle_is_found_however_its_imports_are_written() {
    let two = |a: &str, b: &str| circles_of(&[("lib.rs", "mod a; mod b;"), ("a.rs", a), ("b.rs", b)]);
    let b = "pub struct B; use crate::a::A;";
    for a in [
        "use crate::b::B;",
        "use super::b::B;",
        "use crate::{b::{self, B}};",
        "use super::b as other;",
        "use super::b::*;",
        "fn f(x: crate::b::B) {}",
        "fn f() { super::b::B::new::<u8>() }",
        "mod inner { use super::super::b::B; }",
        "/* of b */ const Q: char = '\"'; use crate::b::B;",
    ] {
        assert_eq!(two(&format!("pub struct A; {a}"), b), ["a.rs b.rs"], "{a}");
    }
    for a in [
        "// use crate::b::B;",
        "/// [`crate::b::B`]\nfn f() {}",
        "const S: &str = \"crate::b::B\"; const T: &str = r#\"\"crate::b::B\"#;",
        "#[cfg(test)]\nmod tests { use crate::b::B; }",
        "#[cfg(test)]\nuse crate::b::{B};",
        "pub(in crate::b) struct C;",
        "use elsewhere::b::B;",
        "fn f() -> impl Fn() + use<> { crate::c::d }",
    ] {
        assert_eq!(two(&format!("pub struct A; {a}"), b), [""; 0], "{a}");
    }
}

#[test]
fn a_module_may_use_its_parent_but_not_in_a_wider_circle() {
    let three = |a: &str, x: &str, y: &str| {
        circles_of(&[("lib.rs", "mod a; mod c;"), ("a/mod.rs", a), ("a/x.rs", x), ("a/y.rs", y), ("c.rs", "use crate::a::x::X;")])
    };
    assert_eq!(three("mod x; mod y; pub struct A; use x::X;", "use super::A; pub struct X;", "use super::x::X;"), [""; 0]);
    assert_eq!(three("pub mod x; mod y; pub struct A; use crate::c;", "use super::A; pub struct X;", ""), ["a/mod.rs a/x.rs c.rs"]);
    // What is exported again is where it is written.
    assert_eq!(three("pub mod x; mod y; pub use y::Y; use crate::c;", "use super::Y; pub struct X;", "pub struct Y;"), [""; 0]);
    assert_eq!(
        three("pub mod x; mod y; pub use x::*; pub use y::*;", "use super::Y; pub struct X;", "use super::X; pub struct Y;"),
        ["a/x.rs a/y.rs"]
    );
}

/// Roots of all crates: libraries, programs, and programs of tests.
fn roots() -> Vec<PathBuf> {
    let is_root = |p: &Path| {
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let folder = p.parent().unwrap_or(p);
        (name == "lib.rs" || name == "main.rs") && (folder.ends_with("src") || folder.ends_with("tests/all"))
    };
    sources().iter().map(|(name, _)| PathBuf::from(name)).filter(|p| is_root(p)).collect()
}

fn from_disk(file: &Path) -> Option<String> {
    std::fs::read_to_string(root().join(file)).ok()
}

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    let (mut files, mut found) = (0, Vec::new());
    for root in roots() {
        let all = Crate::read(&root, false, &from_disk);
        files += all.modules.len();
        let uses = all.uses();
        for circle in all.circles() {
            found.push(format!("{} files:", circle.len()));
            for (file, used) in circle.iter().map(|f| (f, &uses[f])) {
                found.extend(used.iter().filter(|g| circle.contains(*g)).map(|g| format!("  {} -> {}", file.display(), g.display())));
            }
        }
    }
    assert!(files > 400, "only {files} modules");
    assert!(found.is_empty(), "move what both need into a file of its own:\n{}", found.join("\n"));
}

#[test]
fn no_constants_of_a_crate_have_one_name_and_two_meanings() {
    let two = |a: &str, b: &str| ambiguous(&made_of(&[("lib.rs", "mod a; mod b;"), ("a.rs", a), ("b.rs", b)]));
    for b in [
        "pub const GAP_S: f64 = 3.0;",
        "mod inner { const GAP_S: f64 = 3.0; }",
        "const GAP_S: [f64; 2] = [2.0; 2];",
        "const GAP_S: &str = \"2.0\";",
    ] {
        assert_eq!(two("const GAP_S: f64 = 2.0;", b), ["GAP_S: a.rs b.rs"], "{b}");
    }
    for b in
        ["pub const GAP_S: f64 = 2.0; // s", "impl A { const GAP_S: f64 = 3.0; }", "#[cfg(test)]\nmod tests { const GAP_S: f64 = 3.0; }"]
    {
        assert_eq!(two("const GAP_S: f64 = 2.0;", b), [""; 0], "{b}");
    }
    let products = roots().into_iter().filter(|r| !r.starts_with("tests") && r.parent().is_some_and(|p| p.ends_with("src")));
    let found: Vec<String> = products.flat_map(|r| ambiguous(&Crate::read(&r, false, &from_disk))).collect();
    assert_eq!(found, [""; 0], "say in its name what each is");
}

#[test]
fn every_file_is_a_module_of_a_crate() {
    let known: BTreeSet<PathBuf> =
        roots().iter().flat_map(|r| Crate::read(r, true, &from_disk).modules.into_iter().map(|m| m.file)).collect();
    let in_crates = |p: &Path| p.components().any(|c| c.as_os_str() == "src") || p.to_string_lossy().contains("/tests/all/");
    let all: Vec<PathBuf> = sources().into_iter().map(|(name, _)| PathBuf::from(name)).collect();
    let by_path = sources().iter().flat_map(|(_, text)| text.split("#[path = \"").skip(1).map(str::to_owned)).collect::<Vec<_>>();
    let by_path = |p: &Path| by_path.iter().any(|t| t.split('"').next().is_some_and(|t| Path::new(t).file_name() == p.file_name()));
    let orphans: Vec<&PathBuf> = all.iter().filter(|p| in_crates(p) && !known.contains(*p) && !by_path(p)).collect();
    assert!(known.len() > 400 && orphans.is_empty(), "no `mod` names them, so nothing compiles them: {orphans:?}");
}
