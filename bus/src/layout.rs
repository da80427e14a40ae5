//! How messages lie in memory, told by the types themselves, and the same told in C and Python.

mod c;
mod python;
mod values;

pub use c::c_header;
pub use python::python_module;
pub use values::{Value, values};

/// One number or record that messages are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// 32-bit floating point.
    F32,
    /// 64-bit floating point.
    F64,
    /// 32-bit count.
    U32,
    /// 64-bit count.
    U64,
    /// 64-bit signed whole number.
    I64,
    /// A record, by its Rust name.
    Record(&'static str),
}

/// A field of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name, with its unit.
    pub name: &'static str,
    /// What it holds.
    pub scalar: Scalar,
    /// How many of them; 1 = no array.
    pub count: usize,
    /// Bytes from the start of the record.
    pub offset: usize,
    /// What it means.
    pub doc: &'static str,
}

/// A record as it lies in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordLayout {
    /// Rust name.
    pub name: &'static str,
    /// Name under which the channels know it.
    pub type_name: &'static str,
    /// Bytes.
    pub size: usize,
    /// Fields in their order.
    pub fields: Vec<Field>,
    /// What it is.
    pub doc: &'static str,
}

/// A type that may stand in a message.
pub trait Plain {
    /// What one element is.
    const SCALAR: Scalar;
    /// Number of elements.
    const COUNT: usize;
}

macro_rules! plain {
    ($($number:ty => $scalar:ident),*) => { $(
        impl Plain for $number {
            const SCALAR: Scalar = Scalar::$scalar;
            const COUNT: usize = 1;
        }
    )* };
}
plain!(f32 => F32, f64 => F64, u32 => U32, u64 => U64, i64 => I64);

impl<T: Plain, const N: usize> Plain for [T; N] {
    const SCALAR: Scalar = T::SCALAR;
    const COUNT: usize = N;
}

/// Defines a record of plain numbers without gaps, with its layout.
macro_rules! record {
    (
        #[doc = $doc:literal]
        $name:ident = $type_name:tt {
            $( #[doc = $field_doc:literal] $field:ident: $kind:ty, )*
        }
    ) => {
        #[doc = $doc]
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable,
            ZeroCopySend,
        )]
        #[repr(C)]
        #[type_name($type_name)]
        pub struct $name {
            $( #[doc = $field_doc] pub $field: $kind, )*
        }

        impl $crate::layout::Plain for $name {
            const SCALAR: $crate::layout::Scalar = $crate::layout::Scalar::Record(stringify!($name));
            const COUNT: usize = 1;
        }

        impl $name {
            /// How it lies in memory.
            pub fn layout() -> $crate::layout::RecordLayout {
                use $crate::layout::{Field, Plain};
                $crate::layout::RecordLayout {
                    name: stringify!($name),
                    type_name: $type_name,
                    size: size_of::<$name>(),
                    fields: vec![ $( Field {
                        name: stringify!($field),
                        scalar: <$kind as Plain>::SCALAR,
                        count: <$kind as Plain>::COUNT,
                        offset: std::mem::offset_of!($name, $field),
                        doc: $field_doc.trim_ascii(),
                    }, )* ],
                    doc: $doc.trim_ascii(),
                }
            }
        }
    };
}
pub(crate) use record;
