//! A program whose dictionary is private, and which uses hardly anything of it.

mod od {
    lexican_runtime::include_od!("siko_ag03_1");
}

fn main() {
    let node = lexican_runtime::NodeId::literal(5);
    println!("{} has {} entries", od::PRODUCT_NAME, od::NAMES.len());
    println!("{:?}", od::storage(node).get(od::TARGET_POSITION));
}
