//! Circles of imports: files of one crate, none of which can be understood without the others.
//!
//! An edge goes from a file to the file that defines a name it uses, by an import or by a path in the code, macros
//! included. A re-export is followed to the definition, so a child that takes a name from its parent depends on the
//! parent only if the parent itself defines that name. Declaring or importing a module, and re-exporting a name, make
//! no edge; each use of them does. Test modules are ignored, because they may use everything that they test.
//!
//! What a macro defines counts as defined in the file that calls the macro. Methods, and macros called without a path,
//! are not followed.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::parse::Parser;
use syn::{Item, UseTree, Visibility};

use crate::api::is_for_tests;

/// All circles in the crates among `files`, which maps paths to texts.
pub(super) fn findings(files: &BTreeMap<&str, &str>) -> Result<Vec<String>, String> {
    let mut edges = Edges::default();
    for root in files.keys().filter(|path| is_root(path)) {
        Crate::read(files, root)?.add_to(&mut edges);
    }
    Ok(edges.circles().iter().map(|circle| edges.describe(circle)).collect())
}

/// Whether cargo builds a crate from this file.
fn is_root(path: &str) -> bool {
    let mut parts = path.rsplit('/');
    let (name, folder) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    matches!(name, "lib.rs" | "main.rs") || matches!(folder, "bin" | "benches" | "examples" | "tests")
}

/// For each file, the files that it uses, each with the names.
#[derive(Default)]
struct Edges(BTreeMap<String, BTreeMap<String, BTreeSet<String>>>);

impl Edges {
    /// All files that a file needs, directly or not.
    fn reached_from<'a>(&'a self, from: &str) -> BTreeSet<&'a str> {
        let mut reached = BTreeSet::new();
        let mut open: Vec<&str> = self.used_by(from).collect();
        while let Some(file) = open.pop() {
            if reached.insert(file) {
                open.extend(self.used_by(file));
            }
        }
        reached
    }

    fn used_by<'a>(&'a self, file: &str) -> impl Iterator<Item = &'a str> + use<'a> {
        self.0.get(file).into_iter().flat_map(BTreeMap::keys).map(String::as_str)
    }

    /// The sets of files that all need each other.
    fn circles(&self) -> Vec<BTreeSet<&str>> {
        let reached: BTreeMap<&str, BTreeSet<&str>> =
            self.0.keys().map(|file| (file.as_str(), self.reached_from(file))).collect();
        let mut circles: Vec<BTreeSet<&str>> = Vec::new();
        for (file, needed) in reached.iter().filter(|(file, needed)| needed.contains(*file)) {
            if !circles.iter().any(|circle| circle.contains(file)) {
                let needs_it = |other: &&str| reached.get(other).is_some_and(|needed| needed.contains(file));
                circles.push(needed.iter().copied().filter(needs_it).collect());
            }
        }
        circles
    }

    /// Describes a circle: its files, and the names that they use of each other.
    fn describe(&self, circle: &BTreeSet<&str>) -> String {
        let first = circle.first().copied().unwrap_or_default();
        let mut text = format!("{first}: a circle of {} files that import each other:", circle.len());
        for from in circle {
            for (to, names) in self.0.get(*from).into_iter().flatten().filter(|(to, _)| circle.contains(to.as_str())) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                text += &format!("\n    {from} -> {to}: {}", names.join(", "));
            }
        }
        text
    }
}

/// The modules of a crate; the first one is its root.
struct Crate<'a> {
    files: &'a BTreeMap<&'a str, &'a str>,
    modules: Vec<Module>,
}

struct Module {
    file: String,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// The names of its items, each with its file. Exported macros are items of the root.
    defined: BTreeMap<String, String>,
    imports: Vec<Import>,
    /// Paths in the code, including single names.
    paths: BTreeSet<Vec<String>>,
}

#[derive(Clone)]
struct Import {
    path: Vec<String>,
    /// The name it imports; `*` for all.
    name: String,
    is_reexport: bool,
}

/// What a path leads to.
enum Place {
    Module(usize),
    Item { file: String, name: String },
}

impl<'a> Crate<'a> {
    fn read(files: &'a BTreeMap<&'a str, &'a str>, root: &str) -> Result<Self, String> {
        let mut all = Crate { files, modules: Vec::new() };
        all.file(root, above(root), None)?;
        Ok(all)
    }

    /// Reads a file whose modules lie in `folder`.
    fn file(&mut self, file: &str, folder: &str, parent: Option<usize>) -> Result<usize, String> {
        let text = self.files.get(file).ok_or_else(|| format!("{file}: there is no such file"))?;
        let parsed = syn::parse_file(text).map_err(|error| format!("{file}: {error}"))?;
        self.items(parsed.items, file, folder, parent)
    }

    fn items(&mut self, items: Vec<Item>, file: &str, folder: &str, parent: Option<usize>) -> Result<usize, String> {
        let here = self.modules.len();
        self.modules.push(Module {
            file: file.to_owned(),
            parent,
            children: BTreeMap::new(),
            defined: BTreeMap::new(),
            imports: Vec::new(),
            paths: BTreeSet::new(),
        });
        for item in items.into_iter().filter(|item| !is_for_tests(item)) {
            match item {
                Item::Mod(inner) => {
                    let name = plain(&inner.ident);
                    let folder = format!("{folder}/{name}");
                    let child = match inner.content {
                        Some((_, items)) => {
                            let given = path_of(&inner.attrs).map(|path| beside(file, &path));
                            let folder = given.as_deref().map_or(&*folder, |given| given.trim_end_matches('/'));
                            self.items(items, file, folder, Some(here))?
                        }
                        None => {
                            let (path, folder) = match path_of(&inner.attrs) {
                                Some(path) => {
                                    let path = beside(file, &path);
                                    let folder = above(&path).to_owned();
                                    (Some(path), folder)
                                }
                                None => {
                                    let usual = [format!("{folder}.rs"), format!("{folder}/mod.rs")];
                                    (usual.into_iter().find(|path| self.files.contains_key(path.as_str())), folder)
                                }
                            };
                            let path = path.ok_or_else(|| format!("{file}: there is no file of the module {name}"))?;
                            self.file(&path, &folder, Some(here))?
                        }
                    };
                    self.modules[here].children.insert(name, child);
                }
                Item::Use(item) => {
                    let is_reexport = !matches!(item.vis, Visibility::Inherited);
                    self.modules[here].take_import(&item.tree, &mut Vec::new(), is_reexport);
                }
                item => {
                    let is_exported = matches!(&item, Item::Macro(item) if is_exported(item));
                    if let Some(name) = name_of(&item) {
                        let place = if is_exported { 0 } else { here };
                        self.modules[place].defined.insert(name, file.to_owned());
                    }
                    self.modules[here].take_code(item.into_token_stream());
                }
            }
        }
        Ok(here)
    }

    /// Adds the edges of all files.
    fn add_to(&self, edges: &mut Edges) {
        for (here, module) in self.modules.iter().enumerate() {
            let imports = module.imports.iter().filter(|import| !import.is_reexport).map(|import| &import.path);
            for path in imports.chain(&module.paths) {
                if let Some(Place::Item { file, name }) = self.resolve(here, path, 0)
                    && file != module.file
                {
                    edges.0.entry(module.file.clone()).or_default().entry(file).or_default().insert(name);
                }
            }
        }
    }

    /// Follows a path from a module; `None` if it leads out of the crate.
    fn resolve(&self, from: usize, path: &[String], depth: usize) -> Option<Place> {
        let (first, rest) = path.split_first()?;
        let mut place = match first.as_str() {
            "crate" => Place::Module(0),
            "self" => Place::Module(from),
            "super" => Place::Module(self.modules[from].parent?),
            name => self.named(from, name, !rest.is_empty(), depth)?,
        };
        for (index, name) in rest.iter().enumerate() {
            let Place::Module(module) = place else { break };
            place = match name.as_str() {
                "super" => Place::Module(self.modules[module].parent?),
                // A macro defines what is not found there.
                name => self
                    .named(module, name, index + 1 < rest.len(), depth)
                    .unwrap_or_else(|| Place::Item { file: self.modules[module].file.clone(), name: name.to_owned() }),
            };
        }
        Some(place)
    }

    /// Looks up a name in a module. A module may have the same name as a function or macro; `is_module` prefers the
    /// module.
    fn named(&self, module: usize, name: &str, is_module: bool, depth: usize) -> Option<Place> {
        // Break endless recursion: a macro re-exported under its own name, or globs in a circle.
        if depth > 16 {
            return None;
        }
        let found = &self.modules[module];
        let item = found.defined.get(name).map(|file| Place::Item { file: file.clone(), name: name.to_owned() });
        let child = found.children.get(name).map(|child| Place::Module(*child));
        let own = if is_module { child.or(item) } else { item.or(child) };
        own.or_else(|| {
            let mut named = found.imports.iter().filter(|import| import.name == name);
            named.find_map(|import| self.resolve(module, &import.path, depth + 1))
        })
        .or_else(|| {
            // A glob whose path begins with the name would look up the name again.
            let is_glob =
                |import: &&Import| import.name == "*" && import.path.first().is_none_or(|first| first != name);
            let mut globs = found.imports.iter().filter(is_glob);
            globs.find_map(|import| match self.resolve(module, &import.path, depth + 1)? {
                Place::Module(other) if other != module => self.named(other, name, is_module, depth + 1),
                _ => None,
            })
        })
    }
}

impl Module {
    fn take_import(&mut self, tree: &UseTree, before: &mut Vec<String>, is_reexport: bool) {
        let mut add = |path: &[String], name: &str| {
            self.imports.push(Import { path: path.to_vec(), name: name.to_owned(), is_reexport });
        };
        match tree {
            UseTree::Path(path) => {
                before.push(plain(&path.ident));
                self.take_import(&path.tree, before, is_reexport);
                before.pop();
            }
            UseTree::Name(name) if name.ident == "self" => add(before, before.last().map_or("", String::as_str)),
            UseTree::Name(name) => add(&[before.as_slice(), &[plain(&name.ident)]].concat(), &plain(&name.ident)),
            UseTree::Rename(name) if name.ident == "self" => add(before, &plain(&name.rename)),
            UseTree::Rename(name) => add(&[before.as_slice(), &[plain(&name.ident)]].concat(), &plain(&name.rename)),
            UseTree::Glob(_) => add(before, "*"),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.take_import(tree, before, is_reexport);
                }
            }
        }
    }

    /// Takes the paths in code, and the imports, which count for the whole module.
    fn take_code(&mut self, code: TokenStream) {
        let tokens: Vec<TokenTree> = code.into_iter().collect();
        let is = |index: usize, wanted: char| matches!(tokens.get(index), Some(TokenTree::Punct(found)) if found.as_char() == wanted);
        let ident = |index: usize| match tokens.get(index) {
            Some(TokenTree::Ident(ident)) => Some(plain(ident)),
            _ => None,
        };
        let mut index = 0;
        while let Some(token) = tokens.get(index) {
            let before = |back: usize, wanted: char| index >= back && is(index - back, wanted);
            match token {
                TokenTree::Group(group) => self.take_code(group.stream()),
                TokenTree::Ident(word) if word == "use" => {
                    let tree: TokenStream =
                        tokens[index + 1..].iter().take_while(|token| token.to_string() != ";").cloned().collect();
                    let parse = <UseTree as syn::parse::Parse>::parse;
                    // `use<'a>` is no import.
                    if let Ok(tree) = parse.parse2(tree) {
                        self.take_import(&tree, &mut Vec::new(), false);
                    }
                }
                TokenTree::Ident(word) => {
                    let is_member = before(1, '.') && !before(2, '.');
                    let is_variable = before(1, '\'') || before(1, '$') && word != "crate";
                    let is_continued = before(1, ':') && before(2, ':');
                    let mut path = vec![plain(word)];
                    while is(index + 1, ':')
                        && is(index + 2, ':')
                        && let Some(next) = ident(index + 3)
                    {
                        path.push(next);
                        index += 3;
                    }
                    if !is_member && !is_variable && !is_continued {
                        self.paths.insert(path);
                    }
                }
                _ => {}
            }
            index += 1;
        }
    }
}

/// The name without `r#`.
fn plain(ident: &syn::Ident) -> String {
    let name = ident.to_string();
    name.strip_prefix("r#").unwrap_or(&name).to_owned()
}

/// The folder of a file.
fn above(file: &str) -> &str {
    file.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// Resolves a path relative to the folder of a file.
fn beside(file: &str, mut path: &str) -> String {
    let mut folder = above(file);
    while let Some(rest) = path.strip_prefix("../") {
        (folder, path) = (above(folder), rest);
    }
    format!("{folder}/{path}").trim_start_matches('/').to_owned()
}

/// The file that a `#[path]` attribute names.
fn path_of(attributes: &[syn::Attribute]) -> Option<String> {
    let attribute = attributes.iter().find(|attribute| attribute.path().is_ident("path"))?;
    match &attribute.meta.require_name_value().ok()?.value {
        syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. }) => Some(path.value()),
        _ => None,
    }
}

fn is_exported(item: &syn::ItemMacro) -> bool {
    item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export"))
}

/// The name that an item defines.
fn name_of(item: &Item) -> Option<String> {
    match item {
        Item::Const(item) => Some(plain(&item.ident)),
        Item::Enum(item) => Some(plain(&item.ident)),
        Item::Fn(item) => Some(plain(&item.sig.ident)),
        Item::Macro(item) => item.ident.as_ref().map(plain),
        Item::Static(item) => Some(plain(&item.ident)),
        Item::Struct(item) => Some(plain(&item.ident)),
        Item::Trait(item) => Some(plain(&item.ident)),
        Item::Type(item) => Some(plain(&item.ident)),
        Item::Union(item) => Some(plain(&item.ident)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        findings(&files.iter().copied().collect()).unwrap()
    }

    #[test]
    fn a_circle_is_reported_with_its_files_and_names() {
        let circle = [
            ("src/lib.rs", "mod bus; mod frame; mod id;"),
            ("src/bus.rs", "use crate::frame::{Data, Frame as F};\npub struct Bus;"),
            ("src/frame.rs", "pub struct Frame; pub struct Data; fn f() { super::id::next() }"),
            ("src/id.rs", "pub fn next() { let _ = crate::bus::Bus; }"),
        ];
        let expected = "src/bus.rs: a circle of 3 files that import each other:\n    src/bus.rs -> src/frame.rs: Data, \
                        Frame\n    src/frame.rs -> src/id.rs: next\n    src/id.rs -> src/bus.rs: Bus";
        assert_eq!(found(&circle), [expected]);
        assert_eq!(found(&[&circle[..3], &[("src/id.rs", "pub fn next() {}")]].concat()), [""; 0]);
    }

    #[test]
    fn a_reexport_is_followed_to_the_definition() {
        let tree = |parent, child| {
            let event = "pub struct Event; pub trait Link {}";
            found(&[
                ("src/main.rs", "mod a;"),
                ("src/a/mod.rs", parent),
                ("src/a/b.rs", child),
                ("src/a/event.rs", event),
            ])
            .len()
        };
        let own = "mod b; mod event; pub use event::Event; pub struct Own; fn f() { b::g() }";
        assert_eq!(tree(own, "use super::Event; pub fn g() {}"), 0);
        assert_eq!(tree(own, "use super::*; pub fn g() -> Event {}"), 0);
        assert_eq!(tree(own, "use super::Own; pub fn g() {}"), 1);
        assert_eq!(tree(own, "use super::*; pub fn g() -> Own {}"), 1);
        assert_eq!(tree(own, "use crate::a; pub fn g() -> a::Own {}"), 1);
        assert_eq!(tree(own, "pub fn g() { use super::Own as O; }"), 1);
    }

    #[test]
    fn modules_and_reexports_are_no_edges_but_their_use_is() {
        let tree =
            |parent| found(&[("src/lib.rs", parent), ("src/child.rs", "use crate::Own; pub struct Child;")]).len();
        assert_eq!(tree("mod child; pub use child::Child; pub struct Own;"), 0);
        assert_eq!(tree("mod child; pub use child::Child; pub struct Own(Child);"), 1);
        assert_eq!(tree("mod child; use child::Child; pub struct Own;"), 1);
        assert_eq!(tree("mod child; pub struct Own { child: u8 } fn f(own: Own) { own.child }"), 0);
    }

    #[test]
    fn macros_are_searched_and_may_define() {
        let tree =
            |child| found(&[("src/lib.rs", "mod child; own!(Own); fn f() { child::g!() }"), ("src/child.rs", child)]);
        assert_eq!(tree("macro_rules! g { () => { $crate::Own } } pub(crate) use g;").len(), 1);
        assert_eq!(tree("macro_rules! g { ($Own:ident) => { $Own } } pub(crate) use g;"), [""; 0]);
    }

    #[test]
    fn modules_for_tests_are_left_out() {
        let tests = "pub fn g() {} #[cfg(test)] mod tests { use crate::f; }";
        assert_eq!(found(&[("src/lib.rs", "mod a; pub fn f() { a::g() }"), ("src/a.rs", tests)]), [""; 0]);
    }

    #[test]
    fn a_module_may_lie_elsewhere() {
        let root = "#[path = \"../support/bus.rs\"] mod bus; fn f() { bus::g() }";
        let files = |bus| found(&[("tests/boot/main.rs", root), ("tests/support/bus.rs", bus)]).len();
        assert_eq!((files("pub fn g() { crate::f() }"), files("pub fn g() {}")), (1, 0));
        let inline = "#[path = \"\"] mod whole { mod bus; } fn f() { whole::bus::g() }";
        let files = |bus| found(&[("src/main.rs", inline), ("src/bus.rs", bus)]).len();
        assert_eq!((files("pub fn g() { crate::f() }"), files("pub fn g() {}")), (1, 0));
        let missing = findings(&[("src/lib.rs", "mod gone;")].into());
        assert_eq!(missing, Err("src/lib.rs: there is no file of the module gone".to_owned()));
    }
}
