//! What all emitters need.

use proc_macro2::TokenStream;

use crate::plan::Plan;

/// What is printed, and what the paths in it begin with.
pub(super) struct Context<'a> {
    pub(super) plan: &'a Plan<'a>,
    /// The runtime.
    pub(super) runtime: TokenStream,
    /// Its module `object`, and the same as text.
    pub(super) object: TokenStream,
    pub(super) path: String,
}

/// Appends items, an empty line before each.
pub(super) fn print(items: TokenStream, code: &mut String) {
    let file: syn::File = syn::parse2(items).expect("what the emitters write is Rust");
    for item in file.items {
        let alone = syn::File { shebang: None, frontmatter: None, attrs: Vec::new(), items: vec![item] };
        code.push('\n');
        code.push_str(&prettyplease::unparse(&alone));
    }
}
