//! Parameters of other interfaces; each interface becomes a module.

use lexican_eds::Diagnostics;
use lexican_eds::model::{Device, Interface, Meaning, Parameter};

use super::object::{Handle, handle};
use super::value::Types;
use crate::name::{self, Case};
use crate::scope::{self, Claim};

/// Module names that interfaces must not take.
const MODULES: &[&str] = &["driver", "marked"];
/// Names that parameters must not take.
const RESERVED: &[&str] = &["TABLE"];

#[derive(Debug)]
pub(crate) struct InterfaceItem<'a> {
    pub(crate) ident: String,
    pub(crate) name: &'a str,
    pub(crate) interface: &'a Interface,
    pub(crate) parameters: Vec<ParameterItem<'a>>,
}

#[derive(Debug)]
pub(crate) struct ParameterItem<'a> {
    pub(crate) parameter: &'a Parameter,
    /// As for the object that the parameter equals.
    pub(crate) handle: Handle<'a>,
    /// Numbers of the interface and the equal numbers of the object, by the former.
    pub(crate) codes: Vec<(i128, i128)>,
}

pub(crate) fn interfaces<'a>(device: &'a Device, types: &Types, findings: &mut Diagnostics) -> Vec<InterfaceItem<'a>> {
    let claim =
        |(name, interface): (&String, &Interface)| Claim::new(name, Case::Snake, "interface".into(), interface.span);
    let claims: Vec<Claim> = device.interfaces.iter().map(claim).collect();
    let idents = scope::resolve("interface", MODULES, &claims, findings);
    let interfaces = device.interfaces.iter().zip(idents);
    interfaces.map(|((name, interface), ident)| item(device, types, (name, interface), ident, findings)).collect()
}

fn item<'a>(
    device: &'a Device,
    types: &Types,
    (name, interface): (&'a str, &'a Interface),
    ident: String,
    findings: &mut Diagnostics,
) -> InterfaceItem<'a> {
    // Parameters that are no integers were reported by the reader.
    let carried = interface
        .parameters
        .iter()
        .filter(|parameter| parameter.data_type.range().is_some() && parameter.entry.data_type.range().is_some());
    let mut parameters: Vec<ParameterItem<'a>> = carried
        .map(|parameter| {
            // Findings about an object are reported for the object itself.
            let handle = handle(&parameter.entry, types, &mut Diagnostics::default());
            ParameterItem { parameter, handle, codes: codes(device, parameter) }
        })
        .collect();
    let claim = |item: &ParameterItem<'_>| {
        let suffix = name::identifier(&item.parameter.number.to_string(), Case::Snake);
        Claim::new(&item.parameter.entry.name, Case::Shouty, suffix.trim_matches('_').into(), item.parameter.span)
    };
    let claims: Vec<Claim> = parameters.iter().map(claim).collect();
    let idents = scope::resolve("parameter", RESERVED, &claims, findings);
    parameters.iter_mut().zip(idents).for_each(|(item, ident)| item.handle.ident = ident);
    InterfaceItem { ident, name, interface, parameters }
}

/// Values that the enumeration lacks were reported by the reader.
fn codes(device: &Device, parameter: &Parameter) -> Vec<(i128, i128)> {
    let Meaning::Enumeration(name) = &parameter.entry.meaning else { return Vec::new() };
    let known = device.enumerations.get(name).map_or(&[][..], |enumeration| &enumeration.values);
    let of_name = |name: &str| known.iter().find(|known| known.name == name).map(|known| known.value);
    parameter.values.iter().filter_map(|value| Some((value.value, of_name(&value.name)?))).collect()
}
