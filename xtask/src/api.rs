//! The public API of every library, in a file that each change of it has to change: `tests/api/<package>.txt`.
//!
//! It is read from the sources, so that any toolchain gives the same text. Whatever is `pub` is also reachable; the
//! lint `unreachable_pub` checks this. Items made by macros are listed as the call and its arguments. Generated
//! dictionaries have golden files of their own.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};
use quote::ToTokens;
use syn::{Fields, ImplItem, Item, TraitItem, Type, Visibility};

use crate::{outside, package};

/// Writes the files; with `check`, only compares them.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let mut wrong = Vec::new();
    for package in package::published(root)? {
        let lib = package.manifest_path.with_file_name("src/lib.rs");
        if !lib.exists() {
            continue;
        }
        let file = root.join("tests/api").join(format!("{}.txt", package.name));
        let text = Library::read(&lib)?.print();
        if !check {
            outside::write(&file, &text)?;
            continue;
        }
        let kept = fs::read_to_string(&file).unwrap_or_default();
        if kept != text {
            let (old, new): (BTreeSet<&str>, BTreeSet<&str>) = (kept.lines().collect(), text.lines().collect());
            let gone = old.difference(&new).map(|line| format!("- {line}"));
            let come = new.difference(&old).map(|line| format!("+ {line}"));
            wrong.push(format!("{}:\n{}", file.display(), gone.chain(come).collect::<Vec<_>>().join("\n")));
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!("{}\nwhen it is meant: cargo xtask api, and commit the files", wrong.join("\n")))
}

/// The modules of a library with their public items.
#[derive(Default)]
struct Library {
    modules: Vec<(String, Vec<Item>)>,
    /// The names of all public types and traits.
    names: BTreeSet<String>,
    /// The macros that make items.
    used: BTreeSet<String>,
    /// The macros whose items are visible only inside of the library.
    internal: BTreeSet<String>,
}

impl Library {
    fn read(lib: &Path) -> Result<Self, String> {
        let mut library = Library::default();
        library.file(lib, lib.parent().unwrap_or(lib), "crate")?;
        Ok(library)
    }

    /// Reads a file whose modules lie in `folder`.
    fn file(&mut self, file: &Path, folder: &Path, module: &str) -> Result<(), String> {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        self.take(&text, folder, module).map_err(|error| format!("{}: {error}", file.display()))
    }

    fn take(&mut self, text: &str, folder: &Path, module: &str) -> Result<(), String> {
        let tokens: TokenStream = text.parse().map_err(|error| format!("{error}"))?;
        let parsed: syn::File = syn::parse2(without_docs(tokens)).map_err(|error| error.to_string())?;
        self.items(parsed.items, folder, module)
    }

    fn items(&mut self, items: Vec<Item>, folder: &Path, module: &str) -> Result<(), String> {
        let place = self.modules.len();
        self.modules.push((module.to_owned(), Vec::new()));
        for mut item in items {
            if is_for_tests(&item) {
                continue;
            }
            if let Item::Mod(inner) = &mut item {
                let name = inner.ident.to_string();
                let (folder, path) = (folder.join(&name), format!("{module}::{name}"));
                match inner.content.take() {
                    Some((_, items)) => self.items(items, &folder, &path)?,
                    None => self.file(&file_of(&folder), &folder, &path)?,
                }
                inner.semi = Some(Default::default());
            }
            match &item {
                Item::Macro(syn::ItemMacro { ident: None, mac, .. }) => self.used.extend(called(mac)),
                Item::Macro(syn::ItemMacro { ident: Some(name), mac, .. }) if is_internal(&mac.tokens) => {
                    self.internal.insert(name.to_string());
                }
                _ => {}
            }
            if let Item::Struct(syn::ItemStruct { ident, vis, .. })
            | Item::Enum(syn::ItemEnum { ident, vis, .. })
            | Item::Trait(syn::ItemTrait { ident, vis, .. })
            | Item::Type(syn::ItemType { ident, vis, .. }) = &item
                && is_public(vis)
            {
                self.names.insert(ident.to_string());
            }
            self.modules[place].1.push(item);
        }
        Ok(())
    }

    fn print(mut self) -> String {
        let mut text = String::new();
        for (module, items) in std::mem::take(&mut self.modules) {
            let items: Vec<Item> = items.into_iter().filter_map(|item| self.public(item)).collect();
            if !items.is_empty() {
                let file = syn::File { shebang: None, frontmatter: None, attrs: Vec::new(), items };
                text += &format!("// {module}\n{}\n", prettyplease::unparse(&file));
            }
        }
        text
    }

    /// The item as users see it: without bodies, values and private fields. `None` if they do not see it.
    fn public(&self, mut item: Item) -> Option<Item> {
        match &mut item {
            Item::Const(item) => {
                *item.expr = syn::parse_quote!(_);
                is_public(&item.vis)
            }
            Item::Static(item) => {
                *item.expr = syn::parse_quote!(_);
                is_public(&item.vis)
            }
            Item::Fn(item) => {
                *item.block = syn::parse_quote!({});
                is_public(&item.vis)
            }
            Item::Struct(item) => {
                public_fields(&mut item.fields);
                is_public(&item.vis)
            }
            Item::Enum(item) => is_public(&item.vis),
            Item::Trait(item) => {
                for member in &mut item.items {
                    if let TraitItem::Fn(member) = member {
                        member.default = member.default.take().map(|_| syn::parse_quote!({}));
                    }
                }
                is_public(&item.vis)
            }
            Item::Impl(item) => self.public_members(item),
            Item::Macro(item) => {
                let is_exported = item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export"));
                if is_exported {
                    item.mac.tokens = TokenStream::new();
                }
                let name = item.ident.as_ref().map(ToString::to_string);
                let is_used = name.as_ref().is_none_or(|name| self.used.contains(name));
                let is_internal = name.or_else(|| called(&item.mac)).is_some_and(|name| self.internal.contains(&name));
                is_exported || is_used && !is_internal
            }
            Item::Mod(item) => is_public(&item.vis),
            Item::Type(item) => is_public(&item.vis),
            Item::Use(item) => is_public(&item.vis),
            _ => false,
        }
        .then_some(item)
    }

    /// Removes from an implementation what users do not see. Returns whether to list it.
    fn public_members(&self, item: &mut syn::ItemImpl) -> bool {
        let is_trait = item.trait_.is_some();
        item.items.retain_mut(|member| match member {
            ImplItem::Fn(member) => {
                member.block = syn::parse_quote!({});
                !is_trait && is_public(&member.vis)
            }
            ImplItem::Const(member) => {
                member.expr = syn::parse_quote!(_);
                is_public(&member.vis)
            }
            ImplItem::Type(_) => true,
            _ => false,
        });
        let of = name_of(&item.self_ty);
        let is_ours = of.is_none_or(|name| self.names.contains(&name));
        let of_ours = item.trait_.as_ref().and_then(|(path, _)| path.segments.last());
        let of_ours = of_ours.is_some_and(|segment| self.names.contains(&segment.ident.to_string()));
        // List a trait's implementation if the trait or the type is ours, and an inherent one if it has public members.
        if is_trait { is_ours || of_ours } else { is_ours && !item.items.is_empty() }
    }
}

fn called(mac: &syn::Macro) -> Option<String> {
    mac.path.get_ident().map(ToString::to_string)
}

/// Whether all items that a macro makes are `pub(super)`, `pub(crate)` or the like.
fn is_internal(body: &TokenStream) -> bool {
    let words = body.to_string();
    let mut public = words.split("pub ").skip(1).peekable();
    public.peek().is_some() && public.all(|rest| rest.trim_start().starts_with('('))
}

/// The name of a type, which may be one of ours; `None` for arrays, references and the like.
fn name_of(of: &Type) -> Option<String> {
    match of {
        Type::Path(path) => path.path.segments.last().map(|segment| segment.ident.to_string()),
        _ => None,
    }
}

fn file_of(folder: &Path) -> PathBuf {
    let file = folder.with_extension("rs");
    if file.exists() { file } else { folder.join("mod.rs") }
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

pub(crate) fn is_for_tests(item: &Item) -> bool {
    let text = item.to_token_stream().to_string();
    text.starts_with("# [cfg (test)]") || text.starts_with("# [cfg (doctest)]")
}

/// Removes private fields, and marks that there were some.
fn public_fields(fields: &mut Fields) {
    let all = fields.len();
    match fields {
        Fields::Named(fields) => {
            let named = std::mem::take(&mut fields.named);
            fields.named = named.into_iter().filter(|field| is_public(&field.vis)).collect();
            if fields.named.len() < all {
                fields.named.push(syn::parse_quote!(_private: ()));
            }
        }
        Fields::Unnamed(fields) => {
            for field in &mut fields.unnamed {
                if !is_public(&field.vis) {
                    field.ty = syn::parse_quote!(_);
                }
            }
        }
        Fields::Unit => {}
    }
}

/// Removes all attributes except those on which users depend, at any depth.
fn without_docs(tokens: TokenStream) -> TokenStream {
    let kept = ["cfg", "derive", "deprecated", "macro_export", "must_use", "non_exhaustive", "repr"];
    let mut out: Vec<TokenTree> = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Group(group) => {
                let first = group.stream().into_iter().next().map(|first| first.to_string());
                let is_kept = first.is_some_and(|first| kept.contains(&first.as_str()));
                let ends_with =
                    |out: &[TokenTree], wanted: &str| out.last().is_some_and(|last| last.to_string() == wanted);
                let is_inner = ends_with(&out, "!") && ends_with(&out[..out.len() - 1], "#");
                let is_attribute = group.delimiter() == Delimiter::Bracket && (is_inner || ends_with(&out, "#"));
                if is_attribute && (is_inner || !is_kept) {
                    out.truncate(out.len() - 1 - usize::from(is_inner));
                } else {
                    out.push(Group::new(group.delimiter(), without_docs(group.stream())).into());
                }
            }
            other => out.push(other),
        }
    }
    out.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(text: &str) -> String {
        let mut library = Library::default();
        library.take(text, Path::new(""), "crate").unwrap();
        library.print()
    }

    #[test]
    fn what_users_see_is_listed() {
        let text = "
            //! Docs.
            /// Docs.
            #[derive(Clone)]
            #[doc(hidden)]
            pub struct Frame { pub id: u8, /** Docs. */ len: u8 }
            impl Frame {
                pub const fn id(&self) -> u8 { self.id }
                fn private(&self) {}
            }
            impl From<u8> for Frame { fn from(id: u8) -> Self { Frame { id, len: 0 } } }
            pub mod inner { pub(crate) fn hidden() {} pub const MOST: u8 = 8; }
            struct Own;
            impl Clone for Own { fn clone(&self) -> Self { Own } }
            #[cfg(test)]
            mod tests { pub fn test() {} }
        ";
        assert_eq!(
            printed(text),
            "// crate\n#[derive(Clone)]\npub struct Frame {\n    pub id: u8,\n    _private: (),\n}\nimpl Frame {\n    \
             pub const fn id(&self) -> u8 {}\n}\nimpl From<u8> for Frame {}\npub mod inner;\n\n\
             // crate::inner\npub const MOST: u8 = _;\n\n"
        );
    }

    #[test]
    fn documentation_and_bodies_are_no_api() {
        let [one, other] = ["/// A.\npub fn f() { 1; }", "/// B.\n#[inline]\npub fn f() { 2; }"].map(printed);
        assert_eq!(one, other);
        assert_ne!(one, printed("pub fn f(_: u8) {}"));
        assert_ne!(one, printed("#[cfg(feature = \"std\")]\npub fn f() {}"));
    }

    #[test]
    fn what_macros_make_is_listed_as_they_and_their_arguments() {
        assert!(printed("macro_rules! own { () => { fn f(); } } own!();").contains("fn f()"));
        assert_eq!(printed("numbers! { /// Docs.\n A = 1 }"), "// crate\nnumbers! {\n    A = 1\n}\n\n");
        assert!(printed("macro_rules! own { () => {} }").is_empty());
        assert!(printed("macro_rules! own { () => { pub(super) const A: u8 = 1; } } own!(1);").is_empty());
        assert!(printed("#[macro_export] macro_rules! users { () => {} }").contains("users"));
    }
}
