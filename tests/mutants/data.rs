//! Mutants of constants that are data, such as the description of a drive: of fields, rows and names. These constants
//! are made at run time, so that a mutant can be chosen then.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;

use quote::ToTokens;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprPath, Item, Lit, Type, parse_quote};

use super::Mutator;

/// The constants of a crate, and the names in them.
#[derive(Default)]
pub(super) struct Data {
    /// The constants that are made at run time.
    lazy: BTreeSet<String>,
    /// Names that can replace each other: variants of an enumeration, constants of one module, arguments of a function.
    alike: BTreeMap<String, BTreeSet<String>>,
}

impl Data {
    /// The constants of these files, except those that are used at compile time.
    pub(super) fn of(files: impl Iterator<Item = syn::File>, compiled: &[&str]) -> Self {
        let mut data = Data::default();
        for mut item in files.flat_map(|file| file.items) {
            let Some((name, expr)) = constant(&mut item) else { continue };
            if !compiled.contains(&name.as_str()) {
                data.lazy.insert(name);
                data.visit_expr_mut(expr);
            }
        }
        data
    }

    fn is_lazy(&self, path: &ExprPath) -> bool {
        let segments = &path.path.segments;
        let is_own = segments.len() == 1 || segments[0].ident.to_string().starts_with(char::is_lowercase);
        is_own && segments.last().is_some_and(|last| self.lazy.contains(&last.ident.to_string()))
    }

    /// The next name among those that can replace this one.
    fn other(&self, (kind, name): (String, String)) -> Option<String> {
        let names = self.alike.get(&kind)?;
        let next = names.range::<str, _>((Bound::Excluded(name.as_str()), Bound::Unbounded)).next();
        next.or_else(|| names.first()).filter(|other| **other != name).cloned()
    }
}

impl VisitMut for Data {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if let Some((kind, name)) = named(expr) {
            self.alike.entry(kind).or_default().insert(name);
        }
        visit_mut::visit_expr_mut(self, expr);
    }

    // Do not collect the function: its arguments fit no other.
    fn visit_expr_call_mut(&mut self, call: &mut syn::ExprCall) {
        call.args.iter_mut().for_each(|argument| self.visit_expr_mut(argument));
    }

    // Do not collect items within a constant.
    fn visit_item_mut(&mut self, _: &mut Item) {}
}

impl Mutator {
    /// Makes a constant with data one that is made at run time, with its mutants.
    pub(super) fn lazy(&mut self, item: &mut Item) -> bool {
        let Some((name, expr)) = constant(item).filter(|(name, _)| self.data.lazy.contains(name)) else { return false };
        self.function = name;
        (self.runs, self.is_data) = (true, true);
        self.visit_expr_mut(expr);
        (self.runs, self.is_data) = (false, false);
        let (vis, name, of, expr) = match item {
            Item::Const(item) => (&item.vis, &item.ident, &item.ty, &item.expr),
            Item::Static(item) => (&item.vis, &item.ident, &item.ty, &item.expr),
            _ => return false,
        };
        *item = parse_quote! {
            #vis static #name: ::std::sync::LazyLock<#of> = ::std::sync::LazyLock::new(|| #expr);
        };
        true
    }

    /// An associated constant uses the constant of the original crate, because no mutant can be chosen there.
    pub(super) fn original(&self, expr: &mut Expr) {
        if let Expr::Reference(reference) = expr
            && let Expr::Path(path) = &*reference.expr
            && self.data.is_lazy(path)
        {
            let file = syn::Ident::new(&self.file, proc_macro2::Span::call_site());
            *expr = parse_quote! { &shared::#file::#path };
        }
    }

    /// The constant that a path names, if it is made at run time.
    pub(super) fn lazily(&self, path: &ExprPath) -> Option<Expr> {
        self.data.is_lazy(path).then(|| parse_quote! { (*#path) })
    }

    /// Makes mutants of data. Returns whether the expression has no others.
    pub(super) fn datum(&mut self, expr: &mut Expr) -> bool {
        let text = expr.to_token_stream().to_string();
        let other = named(expr).and_then(|named| self.data.other(named));
        let other: Option<Expr> = match expr {
            Expr::Struct(literal) if literal.rest.is_some() => {
                let mut base = literal.rest.take();
                base.iter_mut().for_each(|base| self.visit_expr_mut(base));
                for field in &mut literal.fields {
                    let (name, text) = (&field.member, field.to_token_stream().to_string());
                    field.colon_token = Some(syn::token::Colon::default());
                    self.visit_expr_mut(&mut field.expr);
                    let (mutant, expr) = (self.mutant(&text, "as before"), &field.expr);
                    field.expr = parse_quote! { (if #mutant { (#base).#name } else { #expr }) };
                }
                literal.rest = base;
                return true;
            }
            Expr::Reference(reference) => match &mut *reference.expr {
                Expr::Array(array) => {
                    let rows: Vec<Expr> = array.elems.iter_mut().map(|row| self.row(row)).collect();
                    *expr = parse_quote! { crate::mutant::rows(::std::vec![#(#rows),*]) };
                    return true;
                }
                inner @ (Expr::Block(_) | Expr::Call(_)) => {
                    self.visit_expr_mut(inner);
                    *expr = parse_quote! { &*::std::boxed::Box::leak(::std::boxed::Box::new(#inner)) };
                    return true;
                }
                _ => return false,
            },
            Expr::Call(call) if call.func.to_token_stream().to_string() == "Some" => Some(parse_quote! { None }),
            Expr::Call(_) | Expr::Path(_) => other.and_then(|other| syn::parse_str(&other).ok()),
            Expr::MethodCall(call) if call.method == "and" || call.method == "clear" => Some((*call.receiver).clone()),
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => {
                    let more = format!("{}x", text.value());
                    Some(parse_quote! { #more })
                }
                _ => None,
            },
            _ => None,
        };
        let Some(mut other) = other else {
            let is_call = matches!(expr, Expr::Call(_));
            self.visit_arguments(expr);
            return is_call;
        };
        let mutant = self.mutant(&text, &other.to_token_stream().to_string());
        self.visit_arguments(expr);
        if let Expr::MethodCall(call) = expr {
            visit_mut::visit_expr_method_call_mut(self, call);
            Plain(self).visit_expr_mut(&mut other);
        }
        *expr = parse_quote! { (if #mutant { #other } else { #expr }) };
        true
    }

    /// Makes mutants of the arguments of a function, but not of the handle of an object.
    fn visit_arguments(&mut self, expr: &mut Expr) {
        if let Expr::Call(call) = expr {
            call.args.iter_mut().for_each(|argument| self.visit_expr_mut(argument));
        }
    }

    /// Makes a mutant without the row.
    fn row(&mut self, row: &mut Expr) -> Expr {
        let mutant = self.mutant(&row.to_token_stream().to_string(), "no row");
        self.visit_expr_mut(row);
        parse_quote! { (#mutant, #row) }
    }
}

/// Dereferences constants that are made at run time, and makes no mutants.
struct Plain<'a>(&'a Mutator);

impl VisitMut for Plain<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        match expr {
            Expr::Path(path) => self.0.lazily(path).into_iter().for_each(|lazy| *expr = lazy),
            _ => visit_mut::visit_expr_mut(self, expr),
        }
    }
}

/// A constant with more than a number.
fn constant(item: &mut Item) -> Option<(String, &mut Expr)> {
    let (name, of, expr) = match item {
        Item::Const(item) => (&item.ident, &item.ty, &mut item.expr),
        Item::Static(item) => (&item.ident, &item.ty, &mut item.expr),
        _ => return None,
    };
    let is_number = |name: &syn::Ident| name.to_string().starts_with(char::is_lowercase);
    let number = matches!(&**of, Type::Path(of) if of.path.get_ident().is_some_and(is_number));
    (!number).then(|| (name.to_string(), &mut **expr))
}

/// The name in an expression, and its kind. Names of one kind can replace each other.
fn named(expr: &Expr) -> Option<(String, String)> {
    let parts = |path: &ExprPath| {
        let mut names: Vec<String> = path.path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        let last = names.pop()?;
        (!names.is_empty()).then(|| (names.join("::"), last))
    };
    match expr {
        Expr::Path(path) => {
            let (kind, last) = parts(path)?;
            // Handles of the dictionary have different types.
            let is_constant = last.starts_with(char::is_uppercase) && kind != "od";
            is_constant.then(|| (kind.clone(), format!("{kind}::{last}")))
        }
        Expr::Call(call) => {
            let (Expr::Path(function), Some(argument)) = (&*call.func, call.args.first()) else { return None };
            let (kind, last) = parts(function)?;
            let text = argument.to_token_stream().to_string().replace(' ', "");
            if call.args.len() == 1 && text.starts_with("od::") {
                Some((format!("{kind}::{last}(od)"), format!("{kind}::{last}({text})")))
            } else if last.starts_with(char::is_uppercase) {
                Some((format!("{kind}::_({text})"), format!("{kind}::{last}({text})")))
            } else {
                None
            }
        }
        _ => None,
    }
}
