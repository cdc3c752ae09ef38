//! Numbers, FMUs and value references that a target makes of random bytes.

use conformance::{Fmu, fmus};
use model_description::variable::VariableKind;
use std::ffi::c_int;
use std::sync::LazyLock;

thread_local! {
    // Each thread has its instances of the libraries, which it makes and frees.
    static FMUS: LazyLock<Vec<Fmu>> = LazyLock::new(fmus);
}

/// Returns one of the FMUs.
pub(crate) fn fmu(bytes: &mut Bytes) -> Fmu {
    FMUS.with(|fmus| fmus[bytes.below(fmus.len())].clone())
}

/// Random bytes that are taken one after the other; after the last one come zeros.
pub(crate) struct Bytes<'a>(pub(crate) &'a [u8]);

impl Bytes<'_> {
    pub(crate) fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    pub(crate) fn below(&mut self, number: usize) -> usize {
        usize::from(u16::from_le_bytes([self.byte(), self.byte()])) % number.max(1)
    }

    pub(crate) fn is(&mut self, one_in: u8) -> bool {
        self.byte().is_multiple_of(one_in)
    }

    fn bits(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// A number, mostly one that a user might choose.
    pub(crate) fn real(&mut self) -> f64 {
        const EDGES: [f64; 8] =
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324, -0.0, 1e17];
        match self.byte() {
            0..=127 => f64::from(self.byte().cast_signed()) / 16.0,
            128..=191 => f64::from(self.byte().cast_signed()) * 1e-4,
            192..=223 => EDGES[self.below(EDGES.len())],
            _ => f64::from_bits(self.bits()),
        }
    }

    pub(crate) fn whole(&mut self) -> c_int {
        if self.is(8) { self.bits() as c_int } else { c_int::from(self.byte().cast_signed()) / 8 }
    }

    /// Value references, mostly of variables that exist and have the chosen type.
    pub(crate) fn references(
        &mut self,
        fmu: &Fmu,
        is_chosen: fn(&VariableKind) -> bool,
    ) -> Vec<u32> {
        let chosen = fmu.references(|variable| is_chosen(&variable.kind));
        let count = fmu.description.variables.len();
        (0..self.byte() % 6)
            .map(|_| match self.byte() {
                0..=3 => self.bits() as u32,
                4..=15 => self.below(count) as u32,
                _ if chosen.is_empty() => 0,
                _ => chosen[self.below(chosen.len())],
            })
            .collect()
    }
}
