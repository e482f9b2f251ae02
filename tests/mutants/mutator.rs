//! Puts mutants into the sources of a crate: an expression becomes one that has another value while `mutant::is(7)` is
//! true. All modules become one file, because `include!` takes only one. Build scripts include this file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{env, fs};

use quote::{ToTokens, quote};
use syn::visit_mut::{self, VisitMut};
use syn::{
    Arm, Attribute, BinOp, Block, Expr, ImplItem, Item, ItemMod, Lit, Pat, Signature, Stmt, Type, UnOp, Visibility,
    parse_quote,
};

#[path = "data.rs"]
mod data;

use data::Data;

/// The sources of a crate.
pub(crate) struct Sources {
    /// The folder, relative to `drives`.
    pub(crate) folder: &'static str,
    /// The modules at the root of the crate.
    pub(crate) modules: &'static [&'static str],
    /// Files of these modules that get no mutants.
    pub(crate) unmutated: &'static [&'static str],
    /// Further files with constants that the modules use.
    pub(crate) constants: &'static [&'static str],
    /// The common beginning of the paths, which names of mutants leave out.
    pub(crate) prefix: &'static str,
    /// Functions without mutants, because they are called at compile time, or by tests and scripts but not by the
    /// drive: a name in any file, or a file and a name.
    pub(crate) others: &'static [&'static str],
    /// Durations that are added to or subtracted from an instant: the operator cannot be replaced there.
    pub(crate) spans: &'static [&'static str],
    /// Exports of the crate besides its modules, and names that these use from elsewhere.
    pub(crate) exports: &'static str,
    /// Whether to mutate constants with more than a number: descriptions and models. They are then made at run time.
    pub(crate) data: bool,
}

impl Sources {
    /// Writes the modules with their mutants, `MUTANTS` and `TESTS` into `mutated.rs`.
    pub(crate) fn mutate(&'static self) {
        let drives = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../../drives");
        let source = drives.join(self.folder);
        println!("cargo::rerun-if-changed={}", source.display());
        let mutated = self.mutated(&source);
        let mut mutator = Mutator { constants: self.constants(&source, &mutated), ..Mutator::new(self) };
        if self.data {
            mutator.data = Data::of(mutated.iter().map(|name| parse(&file(&source, name))), self.others);
        }
        let modules = self.modules.iter().map(|name| {
            let items = module(&source, name, &mut mutator);
            format!("pub mod {name} {{ {} }}\n", quote! { #(#items)* })
        });
        // The modules are no longer at the root of their crate.
        let text = modules.collect::<String>().replace("crate ::", "crate :: mutated ::");
        let text = text.replace("crate :: mutated :: mutant", "crate :: mutant");
        let (names, tests, exports) = (&mutator.names, &mutator.tests, self.exports);
        let paths = tests.iter().map(|test| syn::parse_str::<syn::Path>(test).unwrap());
        let names = quote! {
            pub const MUTANTS: &[&str] = &[#(#names),*];
            pub const TESTS: &[(&str, fn())] = &[#((#tests, #paths)),*];
        };
        let out = env::var("OUT_DIR").unwrap();
        fs::write(Path::new(&out).join("mutated.rs"), format!("{exports}\n{names}\n{text}")).unwrap();
    }

    /// The files that get mutants.
    fn mutated(&self, source: &Path) -> Vec<String> {
        let mut found: Vec<String> = self.modules.iter().map(ToString::to_string).collect();
        let mut next = 0;
        while let Some(name) = found.get(next).cloned() {
            let inner = parse(&file(source, &name)).items.into_iter().filter_map(|item| match item {
                Item::Mod(ItemMod { ident, content: None, .. }) => Some(format!("{name}/{ident}")),
                _ => None,
            });
            found.extend(inner);
            next += 1;
        }
        found.retain(|name| !self.unmutated.contains(&name.as_str()));
        found
    }

    /// The constants that are numbers, by name: where one is used, a mutant uses another number.
    fn constants(&self, source: &Path, mutated: &[String]) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        let mut take = |ident: &syn::Ident, of: &Type| {
            let of = of.to_token_stream().to_string();
            if ["u8", "u16", "i16", "u32", "i32", "f64", "Duration"].contains(&of.as_str()) {
                found.insert(ident.to_string());
            }
        };
        for name in mutated.iter().map(String::as_str).chain(self.constants.iter().copied()) {
            let mut items = parse(&file(source, name)).items;
            while let Some(item) = items.pop() {
                match item {
                    Item::Const(constant) => take(&constant.ident, &constant.ty),
                    Item::Mod(ItemMod { content: Some((_, inner)), .. }) => items.extend(inner),
                    Item::Impl(block) => block.items.iter().for_each(|item| {
                        if let ImplItem::Const(constant) = item {
                            take(&constant.ident, &constant.ty);
                        }
                    }),
                    _ => {}
                }
            }
        }
        found
    }
}

/// Parses a source, without docs and without items that do not exist here.
fn parse(path: &Path) -> syn::File {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Bare.visit_file_mut(&mut file);
    file
}

fn file(source: &Path, name: &str) -> std::path::PathBuf {
    let beside = source.join(format!("{name}.rs"));
    if beside.exists() { beside } else { source.join(name).join("mod.rs") }
}

/// The items of a module, including its child modules.
fn module(source: &Path, name: &str, mutator: &mut Mutator) -> Vec<Item> {
    let mut file = parse(&file(source, name));
    for item in &mut file.items {
        if let Item::Mod(ItemMod { ident, vis, content, semi, .. }) = item
            && (content.is_none() || ident == "tests")
        {
            let name = format!("{name}/{ident}");
            match content {
                Some((_, items)) => mutator.tests.extend(take_tests(&name, items)),
                None => *content = Some((syn::token::Brace::default(), module(source, &name, mutator))),
            }
            *semi = None;
            if matches!(vis, Visibility::Inherited) {
                // The list of tests names it, so it must be visible.
                *vis = parse_quote! { pub(crate) };
            }
        } else if !mutator.sources.unmutated.contains(&name) {
            mutator.file = name.trim_start_matches(mutator.sources.prefix).to_owned();
            if !mutator.lazy(item) {
                mutator.visit_item_mut(item);
            }
        }
    }
    file.items
}

/// Makes the unit tests in a module callable, and returns their paths.
fn take_tests(module: &str, items: &mut [Item]) -> Vec<String> {
    let mut found = Vec::new();
    for item in items {
        if let Item::Fn(function) = item
            && function.attrs.iter().any(|attribute| attribute.path().is_ident("test"))
        {
            (function.attrs, function.vis) = (Vec::new(), parse_quote! { pub(crate) });
            found.push(format!("{}::{}", module.replace('/', "::"), function.sig.ident));
        }
    }
    found
}

/// Removes docs, and items that depend on features, which do not exist here.
struct Bare;

impl VisitMut for Bare {
    fn visit_file_mut(&mut self, file: &mut syn::File) {
        file.attrs.clear();
        file.items.retain(|item| !is_absent(item_attributes(item)));
        visit_mut::visit_file_mut(self, file);
    }

    fn visit_item_impl_mut(&mut self, item: &mut syn::ItemImpl) {
        item.items.retain(|item| !matches!(item, ImplItem::Fn(function) if is_absent(&function.attrs)));
        visit_mut::visit_item_impl_mut(self, item);
    }

    fn visit_attributes_mut(&mut self, attributes: &mut Vec<Attribute>) {
        attributes.retain(|attribute| !attribute.path().is_ident("doc") && !attribute.path().is_ident("cfg"));
    }
}

fn item_attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Mod(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Const(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        _ => &[],
    }
}

fn is_absent(attributes: &[Attribute]) -> bool {
    let is_test = |attribute: &Attribute| attribute.meta.to_token_stream().to_string().replace(' ', "") == "cfg(test)";
    attributes.iter().any(|attribute| attribute.path().is_ident("cfg") && !is_test(attribute))
}

struct Mutator {
    sources: &'static Sources,
    constants: BTreeSet<String>,
    names: Vec<String>,
    /// The unit tests of the sources, by path.
    tests: Vec<String>,
    /// How often each name has been given so far.
    given: BTreeMap<String, usize>,
    file: String,
    function: String,
    /// Whether this is within a function that is called at run time.
    runs: bool,
    data: Data,
    /// Whether this is within a constant that is made at run time.
    is_data: bool,
}

impl Mutator {
    fn new(sources: &'static Sources) -> Self {
        let (constants, names, tests, given, data, file, function) = Default::default();
        Mutator { sources, constants, names, tests, given, file, function, runs: false, data, is_data: false }
    }

    /// The expression that asks whether a new mutant is chosen.
    fn mutant(&mut self, from: &str, to: &str) -> Expr {
        let short = |text: &str| -> String {
            let text = text.replace(" . ", ".").replace(" :: ", "::").replace(" ( ", "(").replace(" )", ")");
            text.replace(" ,", ",").chars().take(90).collect()
        };
        let name = format!("{} {}: {} => {}", self.file, self.function, short(from), short(to));
        let count = self.given.entry(name.clone()).or_default();
        *count += 1;
        self.names.push(if *count == 1 { name } else { format!("{name} #{count}") });
        let number = self.names.len() - 1;
        parse_quote! { crate::mutant::is(#number) }
    }

    /// Makes the mutant in which a condition is always true.
    fn always(&mut self, condition: &mut Expr, text: &str) {
        let mutant = self.mutant(text, "true");
        *condition = parse_quote! { (#mutant || #condition) };
    }

    /// Makes the mutant in which a condition is never true.
    fn never(&mut self, condition: &mut Expr, text: &str) {
        let mutant = self.mutant(text, "false");
        *condition = parse_quote! { (!#mutant && #condition) };
    }

    fn function(&mut self, signature: &mut Signature, block: &mut Block) {
        let file = format!("{} ", self.file);
        if self.sources.others.iter().any(|name| signature.ident == name.strip_prefix(&file).unwrap_or(name)) {
            return;
        }
        signature.constness = None;
        let function = std::mem::replace(&mut self.function, signature.ident.to_string());
        let runs = std::mem::replace(&mut self.runs, true);
        self.visit_block_mut(block);
        block.stmts.insert(0, parse_quote! { crate::mutant::step(); });
        (self.function, self.runs) = (function, runs);
    }

    fn binary(&mut self, binary: &mut syn::ExprBinary) -> Option<Expr> {
        let text = binary.to_token_stream().to_string();
        let sides = [binary.left.to_token_stream().to_string(), binary.right.to_token_stream().to_string()];
        visit_mut::visit_expr_binary_mut(self, binary);
        let other: BinOp = match binary.op {
            BinOp::And(_) | BinOp::Or(_) => {
                let is_and = matches!(binary.op, BinOp::And(_));
                for (side, text) in [&mut *binary.left, &mut *binary.right].into_iter().zip(sides) {
                    // In a chain, each part becomes a side at some level.
                    let is_chain = matches!(side, Expr::Binary(inner) if matches!(inner.op, BinOp::And(_)) && is_and);
                    if matches!(side, Expr::Let(_)) || is_chain {
                        continue;
                    }
                    if is_and {
                        self.always(side, &text);
                    } else {
                        self.never(side, &text);
                    }
                }
                return None;
            }
            BinOp::Lt(_) => parse_quote! { <= },
            BinOp::Le(_) => parse_quote! { < },
            BinOp::Gt(_) => parse_quote! { >= },
            BinOp::Ge(_) => parse_quote! { > },
            BinOp::Eq(_) => parse_quote! { != },
            BinOp::Ne(_) => parse_quote! { == },
            // No duration can be subtracted from an instant.
            BinOp::Add(_) | BinOp::Sub(_) if self.sources.spans.contains(&sides[1].as_str()) => return None,
            BinOp::Add(_) => parse_quote! { - },
            BinOp::Sub(_) => parse_quote! { + },
            // Multiplying or dividing by a sign gives the same.
            BinOp::Mul(_) if sides[1].ends_with("sign ()") => return None,
            BinOp::Mul(_) => parse_quote! { / },
            BinOp::Div(_) => parse_quote! { * },
            _ => return None,
        };
        let is_comparison =
            matches!(other, BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_) | BinOp::Eq(_) | BinOp::Ne(_));
        let [left, right] = sides;
        let mutant = self.mutant(&text, &format!("{left} {} {right}", other.to_token_stream()));
        let syn::ExprBinary { left, op, right, .. } = binary;
        // Compare by reference, so that the operands are not moved.
        let by = if is_comparison {
            quote! { & }
        } else {
            quote! {}
        };
        Some(parse_quote! {
            match (#by (#left), #by (#right)) { (left, right) => if #mutant { left #other right } else { left #op right } }
        })
    }
}

impl VisitMut for Mutator {
    fn visit_item_fn_mut(&mut self, item: &mut syn::ItemFn) {
        self.function(&mut item.sig, &mut item.block);
    }

    fn visit_impl_item_fn_mut(&mut self, item: &mut syn::ImplItemFn) {
        self.function(&mut item.sig, &mut item.block);
    }

    // Compiled, not run.
    fn visit_item_const_mut(&mut self, _: &mut syn::ItemConst) {}

    // An associated constant cannot be a mutant.
    fn visit_impl_item_const_mut(&mut self, item: &mut syn::ImplItemConst) {
        self.original(&mut item.expr);
    }

    fn visit_generic_argument_mut(&mut self, _: &mut syn::GenericArgument) {}
    fn visit_type_mut(&mut self, _: &mut Type) {}

    fn visit_block_mut(&mut self, block: &mut Block) {
        for statement in &mut block.stmts {
            let text = statement.to_token_stream().to_string();
            self.visit_stmt_mut(statement);
            let deletes = matches!(
                statement,
                Stmt::Expr(Expr::MethodCall(_) | Expr::Call(_) | Expr::Assign(_) | Expr::Binary(_), Some(_))
            );
            if self.runs && deletes {
                let mutant = self.mutant(&text, "");
                *statement = parse_quote! { if !#mutant { #statement } };
            }
        }
    }

    fn visit_expr_if_mut(&mut self, expr: &mut syn::ExprIf) {
        let text = expr.cond.to_token_stream().to_string();
        let is_let = text.split_whitespace().any(|word| word == "let");
        visit_mut::visit_expr_if_mut(self, expr);
        if self.runs && !is_let {
            self.always(&mut expr.cond, &text);
            self.never(&mut expr.cond, &text);
        }
    }

    fn visit_expr_match_mut(&mut self, expr: &mut syn::ExprMatch) {
        let patterns: Vec<String> = expr.arms.iter().map(|arm| arm.pat.to_token_stream().to_string()).collect();
        visit_mut::visit_expr_match_mut(self, expr);
        let has_rest = expr.arms.last().is_some_and(|arm| matches!(arm.pat, Pat::Wild(_)));
        let last = expr.arms.len().saturating_sub(1);
        for (at, arm) in expr.arms.iter_mut().enumerate() {
            if self.runs && has_rest && at < last && !matches!(arm.pat, Pat::Guard(_)) {
                let (mutant, pat) = (self.mutant(&patterns[at], "no arm"), &arm.pat);
                let guarded: Arm = parse_quote! { #pat if !#mutant => {} };
                arm.pat = guarded.pat;
            }
        }
    }

    // Of a pattern, only its guard runs.
    fn visit_pat_mut(&mut self, pat: &mut Pat) {
        let Pat::Guard(guarded) = pat else { return };
        let text = guarded.guard.to_token_stream().to_string();
        self.visit_expr_mut(&mut guarded.guard);
        if self.runs {
            self.always(&mut guarded.guard, &text);
            self.never(&mut guarded.guard, &text);
        }
    }

    fn visit_expr_while_mut(&mut self, expr: &mut syn::ExprWhile) {
        visit_mut::visit_expr_while_mut(self, expr);
        expr.body.stmts.insert(0, parse_quote! { crate::mutant::step(); });
    }

    fn visit_expr_loop_mut(&mut self, expr: &mut syn::ExprLoop) {
        visit_mut::visit_expr_loop_mut(self, expr);
        expr.body.stmts.insert(0, parse_quote! { crate::mutant::step(); });
    }

    fn visit_expr_repeat_mut(&mut self, expr: &mut syn::ExprRepeat) {
        self.visit_expr_mut(&mut expr.expr);
    }

    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if !self.runs {
            return visit_mut::visit_expr_mut(self, expr);
        }
        if self.is_data && self.datum(expr) {
            return;
        }
        let text = expr.to_token_stream().to_string();
        let mutated = match expr {
            Expr::Binary(binary) => self.binary(binary),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Not(_) | UnOp::Neg(_)) => {
                let inner = unary.expr.to_token_stream().to_string();
                visit_mut::visit_expr_unary_mut(self, unary);
                let mutant = self.mutant(&text, &inner);
                let syn::ExprUnary { op, expr: of, .. } = unary;
                Some(parse_quote! { match #of { of => if #mutant { of } else { #op of } } })
            }
            Expr::Lit(literal) => match &literal.lit {
                // 0 and 1 are more often indices and parts of idioms than numbers of the manual.
                Lit::Int(number) if number.base10_parse::<u64>().is_ok_and(|number| number > 1) => {
                    // A byte, or two, can hold no more.
                    let other = if ["0xFF", "0xFFFF"].contains(&text.as_str()) {
                        quote! { #literal - 1 }
                    } else {
                        quote! { #literal + 1 }
                    };
                    let mutant = self.mutant(&text, &other.to_string());
                    Some(parse_quote! { (if #mutant { #other } else { #literal }) })
                }
                // A multiple of zero is zero.
                Lit::Float(number) if number.base10_parse::<f64>().is_ok_and(|number| number != 0.0) => {
                    let mutant = self.mutant(&text, &format!("{text} * 1.5"));
                    Some(parse_quote! { (if #mutant { #literal * 1.5 } else { #literal }) })
                }
                Lit::Bool(value) => {
                    let other = !value.value;
                    let mutant = self.mutant(&text, &other.to_string());
                    Some(parse_quote! { (if #mutant { #other } else { #literal }) })
                }
                _ => None,
            },
            Expr::Path(path) => {
                // Some faults and refusals have the name of a bit, and a range has that of an identifier.
                let segments: Vec<String> =
                    path.path.segments.iter().map(|segment| segment.ident.to_string()).collect();
                let named = segments.last().is_some_and(|last| self.constants.contains(last))
                    && !["Fault", "ErrorNumber", "cia301"].contains(&segments[0].as_str());
                if let Some(lazy) = self.lazily(path) {
                    return *expr = lazy;
                }
                named.then(|| {
                    let mutant = self.mutant(&text, "another number");
                    parse_quote! { (if #mutant { crate::mutant::Altered::altered(#path) } else { #path }) }
                })
            }
            Expr::MethodCall(call) if call.method == "min" || call.method == "max" => {
                let other = if call.method == "min" { "max" } else { "min" };
                visit_mut::visit_expr_method_call_mut(self, call);
                if call.args.len() == 1 {
                    let mutant = self.mutant(&text, other);
                    let mut swapped = call.clone();
                    swapped.method = syn::Ident::new(other, call.method.span());
                    Some(parse_quote! { (if #mutant { #swapped } else { #call }) })
                } else {
                    None
                }
            }
            _ => {
                visit_mut::visit_expr_mut(self, expr);
                None
            }
        };
        if let Some(mutated) = mutated {
            *expr = mutated;
        }
    }
}
