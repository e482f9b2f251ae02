//! Puts mutants into the sources of the simulated drive: an expression that can be wrong becomes one that asks
//! `mutant::is(7)` and is wrong then. All modules become one file, since `include!` takes one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{env, fs};

use quote::{ToTokens, quote};
use syn::visit_mut::{self, VisitMut};
use syn::{
    Arm, Attribute, BinOp, Block, Expr, ImplItem, Item, ItemMod, Lit, Pat, Signature, Stmt, Type, UnOp, parse_quote,
};

/// The files whose mutants are made. Not among them: `eeprom`, `follow` and `script`, which are about texts and are
/// tested beside their sources, `trajectory`, and `model` and `setup`, which are data that the verification reads.
const MUTATED: &[&str] = &[
    "state",
    "sim/controller",
    "sim/drive",
    "sim/inputs",
    "sim/leds",
    "sim/motion",
    "sim/node",
    "sim/objects",
    "sim/parameters",
    "sim/power",
    "sim/status",
    "sim/switches",
    "sim/watch",
];

/// Where the constants that they use stand, besides them.
const CONSTANTS: &[&str] = &["fault", "words"];

fn main() {
    let drives = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../../drives");
    let source = drives.join("siko/src");
    println!("cargo::rerun-if-changed={}", source.display());
    println!("cargo::rerun-if-changed=build.rs");
    let mut mutator = Mutator { constants: constants(&source), ..Mutator::default() };
    let [state, sim] = ["state", "sim"].map(|name| {
        let items = module(&source, name, &mut mutator);
        quote! { #(#items)* }.to_string()
    });
    // The modules are no longer below the root of their crate.
    let text = format!("pub mod state {{ {state} }}\npub mod sim {{ {sim} }}")
        .replace("crate ::", "crate :: mutated ::")
        .replace("crate :: mutated :: mutant", "crate :: mutant");
    let names = &mutator.names;
    let names = quote! {
        use shared::{fault, order, words};
        /// What the mutants are, by number.
        pub const MUTANTS: &[&str] = &[#(#names),*];
    };
    let out = env::var("OUT_DIR").unwrap();
    let out = Path::new(&out);
    fs::write(out.join("mutated.rs"), format!("{names}\n{text}")).unwrap();
}

fn parse(path: &Path) -> syn::File {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The items of a module, with its own modules in it.
fn module(source: &Path, name: &str, mutator: &mut Mutator) -> Vec<Item> {
    let beside = source.join(format!("{name}.rs"));
    let mut file = parse(&if beside.exists() { beside } else { source.join(name).join("mod.rs") });
    Bare.visit_file_mut(&mut file);
    for item in &mut file.items {
        if let Item::Mod(ItemMod { ident, content: content @ None, semi, .. }) = item {
            let items = module(source, &format!("{name}/{ident}"), mutator);
            (*content, *semi) = (Some((syn::token::Brace::default(), items)), None);
        } else if MUTATED.contains(&name) {
            mutator.file = name.trim_start_matches("sim/").to_owned();
            mutator.visit_item_mut(item);
        }
    }
    file.items
}

/// The constants that are numbers, by name: a mutant uses another number where it names one.
fn constants(source: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut take = |ident: &syn::Ident, of: &Type| {
        let of = of.to_token_stream().to_string();
        if ["u8", "u16", "i16", "u32", "i32", "f64", "Duration"].contains(&of.as_str()) {
            found.insert(ident.to_string());
        }
    };
    for name in MUTATED.iter().chain(CONSTANTS) {
        let mut items = parse(&source.join(format!("{name}.rs"))).items;
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

/// Takes away tests, docs and what depends on features: none of it is here.
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
        attributes.retain(|attribute| !attribute.path().is_ident("doc"));
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
    attributes.iter().any(|attribute| attribute.path().is_ident("cfg"))
}

#[derive(Default)]
struct Mutator {
    constants: BTreeSet<String>,
    names: Vec<String>,
    /// How often a name was given already.
    given: BTreeMap<String, usize>,
    file: String,
    function: String,
    /// Within a function that is called at run time.
    runs: bool,
}

impl Mutator {
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

    /// A condition that does not matter.
    fn always(&mut self, condition: &mut Expr, text: &str) {
        let mutant = self.mutant(text, "true");
        *condition = parse_quote! { (#mutant || #condition) };
    }

    /// A condition that never holds.
    fn never(&mut self, condition: &mut Expr, text: &str) {
        let mutant = self.mutant(text, "false");
        *condition = parse_quote! { (!#mutant && #condition) };
    }

    fn function(&mut self, signature: &mut Signature, block: &mut Block) {
        // What constants are made with, is not called at run time; what tests and scripts do to the world, and the numbers
        // that they begin with, are no part of the drive; and files are another matter.
        let others =
            ["by", "fault", "bit", "force", "clear", "with", "without", "default", "at_rest", "save", "next_save"];
        if others.iter().any(|name| signature.ident == name) {
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
                    // Of a chain, each part is a side somewhere.
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
            // From an instant, no span can be taken.
            BinOp::Add(_) if ["OVERCURRENT_FOR", "BLOCKED_FOR", "span"].contains(&sides[1].as_str()) => return None,
            BinOp::Add(_) => parse_quote! { - },
            BinOp::Sub(_) => parse_quote! { + },
            // A sign is its own inverse.
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
        // What is compared is not taken away.
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

    // Not run, but compiled.
    fn visit_item_const_mut(&mut self, _: &mut syn::ItemConst) {}
    fn visit_impl_item_const_mut(&mut self, _: &mut syn::ImplItemConst) {}
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

    // Of a pattern, only what guards it runs.
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
                // Nothing and one are indices and parts of idioms more often than numbers of the manual.
                Lit::Int(number) if number.base10_parse::<u64>().is_ok_and(|number| number > 1) => {
                    // There is no more in a byte.
                    let other = if text == "0xFF" {
                        quote! { #literal - 1 }
                    } else {
                        quote! { #literal + 1 }
                    };
                    let mutant = self.mutant(&text, &other.to_string());
                    Some(parse_quote! { (if #mutant { #other } else { #literal }) })
                }
                // Of nothing, there is no more.
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
                // A fault has the name of a bit.
                let segments: Vec<String> =
                    path.path.segments.iter().map(|segment| segment.ident.to_string()).collect();
                let named = segments.last().is_some_and(|last| self.constants.contains(last)) && segments[0] != "Fault";
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
