//! The layouts as a Python module on ctypes.

use super::{Field, RecordLayout, Scalar};

/// A module that defines every record and asserts its size and offsets; `version` is LAYOUT_VERSION.
pub fn python_module(layouts: &[RecordLayout], version: u32) -> String {
    let mut text = format!(
        "\"\"\"Messages of Surefoot, layout version {version}. Written from its types; do not edit.\"\"\"\n\n\
         import ctypes\n\nLAYOUT_VERSION = {version}\n"
    );
    for layout in layouts {
        text += &record(layout);
    }
    text
}

fn record(layout: &RecordLayout) -> String {
    let name = layout.name;
    let mut text = format!("\n\nclass {name}(ctypes.Structure):\n    \"\"\"{}\"\"\"\n\n", layout.doc);
    text += "    _fields_ = [\n";
    for field in &layout.fields {
        text += &format!("        # {}\n        (\"{}\", {}),\n", field.doc, field.name, kind(field));
    }
    text += "    ]\n\n    @staticmethod\n    def type_name() -> str:\n";
    text += &format!(
        "        return \"{}\"\n\n\nassert ctypes.sizeof({name}) == {}\n",
        layout.type_name, layout.size
    );
    for Field { name: field, offset, .. } in &layout.fields {
        text += &format!("assert {name}.{field}.offset == {offset}\n");
    }
    text
}

fn kind(field: &Field) -> String {
    let kind = match field.scalar {
        Scalar::F32 => "ctypes.c_float".to_owned(),
        Scalar::F64 => "ctypes.c_double".to_owned(),
        Scalar::U32 => "ctypes.c_uint32".to_owned(),
        Scalar::U64 => "ctypes.c_uint64".to_owned(),
        Scalar::I64 => "ctypes.c_int64".to_owned(),
        Scalar::Record(name) => name.to_owned(),
    };
    match field.count {
        1 => kind,
        count => format!("{kind} * {count}"),
    }
}
