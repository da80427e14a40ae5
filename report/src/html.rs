//! Pages of HTML that need nothing else: their style and their pictures are in them.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::Picture;

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;color:#1b2230;max-width:1200px;margin:2em auto;padding:0 1em}\
h1{margin-bottom:.1em}h2{margin:2em 0 .3em;font-size:20px;border-top:1px solid #d9dee5;padding-top:.8em}\
p{margin:.3em 0}.soft{color:#5a6474}.verdict{font-size:20px;font-weight:600;margin:.8em 0}.doubt{color:#8a3d00}\
table{border-collapse:collapse;font-size:15px;font-variant-numeric:tabular-nums;margin:.6em 0}\
th,td{padding:3px 14px 3px 0;text-align:left;border-bottom:1px solid #d9dee5;vertical-align:top}\
th{color:#5a6474;font-weight:600}td.failed{color:#d61f3a;font-weight:600}td.passed{color:#0d533b;font-weight:600}\
tr.wrong{color:#b01030}img,svg{width:100%;height:auto;margin:.6em 0}figure{margin:1em 0}figcaption{color:#5a6474}\
code{font-size:14px}";

/// A whole page; `body` is markup.
pub(crate) fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escaped(title)
    )
}

/// A title and a line below it.
pub(crate) fn heading(title: &str, line: &str) -> String {
    format!("<h1>{}</h1>\n{}", escaped(title), soft(line))
}

/// A part with its title; `content` is markup.
pub(crate) fn section(title: &str, content: &str) -> String {
    format!("<h2>{}</h2>\n{content}\n", escaped(title))
}

pub(crate) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// A paragraph of second rank.
pub(crate) fn soft(text: &str) -> String {
    format!("<p class=\"soft\">{}</p>\n", escaped(text))
}

/// A table of rows that [`row`] or others made.
pub(crate) fn table(header: &[impl AsRef<str>], rows: &str) -> String {
    format!("<table>\n<tr>{}</tr>\n{rows}</table>\n", cells("th", header))
}

/// A row of a table.
pub(crate) fn row(of: &[impl AsRef<str>]) -> String {
    format!("<tr>{}</tr>\n", cells("td", of))
}

/// The cells of a row, by the name of their element.
pub(crate) fn cells(tag: &str, texts: &[impl AsRef<str>]) -> String {
    texts.iter().map(|text| format!("<{tag}>{}</{tag}>", escaped(text.as_ref()))).collect()
}

/// A rule, whether it holds and what was found of it.
pub(crate) fn verdict(rule: &str, is_passed: bool, found: &str) -> String {
    let passed = if is_passed { "passed" } else { "failed" };
    let [rule, found] = [rule, found].map(escaped);
    format!("<tr><td>{rule}</td><td class=\"{passed}\">{passed}</td><td>{found}</td></tr>\n")
}

/// A picture with its caption, its bytes in the page.
pub(crate) fn figure(picture: &Picture) -> String {
    let (caption, data) = (escaped(&picture.caption), BASE64_STANDARD.encode(&picture.png));
    format!(
        "<figure><img src=\"data:image/png;base64,{data}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Text that cannot be taken for markup.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
