//! Storage for attributes that most objects and entries lack.

/// Details that are allocated only where they differ from the default: a data sheet may have 65,536 objects of a few
/// bytes each, and limits, overlays and configurations take far more than that.
#[derive(Clone, Debug)]
pub(crate) struct Sparse<T>(Option<Box<T>>);

/// Attributes that are mostly left at their default.
pub(crate) trait Details: Default + PartialEq + 'static {
    /// The default, to refer to where nothing is allocated.
    fn none() -> &'static Self;
}

impl<T: Details> Sparse<T> {
    pub(super) const NONE: Self = Self(None);

    pub(super) fn new(details: T) -> Self {
        Self((details != *T::none()).then(|| Box::new(details)))
    }

    pub(super) fn get(&self) -> &T {
        self.0.as_deref().unwrap_or(T::none())
    }

    pub(super) fn get_mut(&mut self) -> &mut T {
        self.0.get_or_insert_default()
    }
}

impl<T: Details> PartialEq for Sparse<T> {
    fn eq(&self, other: &Self) -> bool {
        self.get() == other.get()
    }
}
