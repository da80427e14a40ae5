//! The layouts as a C header.

use super::{Field, RecordLayout, Scalar};

/// A header that defines every record and asserts its size and offsets; `version` is LAYOUT_VERSION.
pub fn c_header(layouts: &[RecordLayout], version: u32) -> String {
    let mut text = format!(
        "/* Messages of Surefoot, layout version {version}. Written from its types; do not edit. */\n\
         #ifndef SUREFOOT_LAYOUT_H\n#define SUREFOOT_LAYOUT_H\n\n#include <assert.h>\n#include <stddef.h>\n\
         #include <stdint.h>\n\n#define SUREFOOT_LAYOUT_VERSION {version}u\n"
    );
    for layout in layouts {
        text += &record(layout);
    }
    text + "\n#endif\n"
}

fn record(layout: &RecordLayout) -> String {
    let name = layout.name;
    let mut text = format!("\n/* {} Known to the channels as {}. */\n", layout.doc, layout.type_name);
    text += &format!("typedef struct Surefoot{name} {{\n");
    for field in &layout.fields {
        text += &format!("    /* {} */\n    {};\n", field.doc, declaration(field));
    }
    text += &format!("}} Surefoot{name};\n");
    text += &format!("static_assert(sizeof(Surefoot{name}) == {}, \"{name}\");\n", layout.size);
    for Field { name: field, offset, .. } in &layout.fields {
        text +=
            &format!("static_assert(offsetof(Surefoot{name}, {field}) == {offset}, \"{name}.{field}\");\n");
    }
    text
}

fn declaration(field: &Field) -> String {
    let kind = match field.scalar {
        Scalar::F32 => "float".to_owned(),
        Scalar::F64 => "double".to_owned(),
        Scalar::U32 => "uint32_t".to_owned(),
        Scalar::U64 => "uint64_t".to_owned(),
        Scalar::I64 => "int64_t".to_owned(),
        Scalar::Record(name) => format!("Surefoot{name}"),
    };
    match field.count {
        1 => format!("{kind} {}", field.name),
        count => format!("{kind} {}[{count}]", field.name),
    }
}
