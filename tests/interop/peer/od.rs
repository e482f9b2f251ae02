//! The dictionary of `peer.eds`.

lexican_runtime::include_od!("peer");
