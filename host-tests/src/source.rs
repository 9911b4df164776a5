//! Reads the kernel's source as tokens, so that comments, strings and line breaks do not matter to a rule.

use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The folder of the kernel's source.
pub fn kernel_source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../kernel/src")
}

/// One source file as tokens.
pub struct SourceFile {
    /// Path below the source folder, with `/`.
    pub name: String,
    /// The module it holds: `geometry/pose.rs` is `["geometry", "pose"]`.
    pub module: Vec<String>,
    /// Its tokens.
    pub tokens: TokenStream,
}

impl SourceFile {
    /// The file `name` with the content `text`. Panics where the text is not Rust.
    pub fn parse(name: &str, text: &str) -> Self {
        let tokens = text.parse().unwrap_or_else(|error| panic!("{name}: {error}"));
        let path = name.strip_suffix(".rs").unwrap_or(name);
        let path = path.strip_suffix("/mod").unwrap_or(path);
        let module = match path {
            "lib" => Vec::new(),
            _ => path.split('/').map(str::to_owned).collect(),
        };
        Self { name: name.to_owned(), module, tokens }
    }
}

/// Every file below `folder`, sorted by name.
pub fn read_folder(folder: &Path) -> Vec<SourceFile> {
    fn visit(root: &Path, folder: &Path, files: &mut Vec<SourceFile>) {
        let mut entries: Vec<PathBuf> = fs::read_dir(folder)
            .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
            .map(|entry| entry.expect("a readable folder").path())
            .collect();
        entries.sort();
        for path in entries {
            if path.is_dir() {
                visit(root, &path, files);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name =
                    path.strip_prefix(root).expect("below the root").to_string_lossy().replace('\\', "/");
                files.push(SourceFile::parse(&name, &fs::read_to_string(&path).expect("a text file")));
            }
        }
    }
    let mut files = Vec::new();
    visit(folder, folder, &mut files);
    assert!(!files.is_empty(), "no source in {}", folder.display());
    files
}

/// A token that is an identifier or a punctuation mark, with groups opened up, and the module it stands in.
#[derive(Clone, Debug)]
pub struct Token {
    /// The identifier, the single punctuation character, or one of `( ) { } [ ]`; a literal is `"literal"`.
    pub text: String,
    /// Line in its file, from 1.
    pub line: usize,
    /// The module in which the token stands.
    pub module: Vec<String>,
}

/// The tokens outside `#[cfg(test)]` items, in order.
pub fn flatten(file: &SourceFile) -> Vec<Token> {
    let mut out = Vec::new();
    flatten_into(&file.tokens, &file.module, &mut out);
    out
}

fn flatten_into(stream: &TokenStream, module: &[String], out: &mut Vec<Token>) {
    let trees: Vec<TokenTree> = stream.clone().into_iter().collect();
    let mut k = 0;
    let push = |text: String, tree: &TokenTree, out: &mut Vec<Token>| {
        out.push(Token { text, line: tree.span().start().line, module: module.to_vec() });
    };
    while k < trees.len() {
        if is_cfg_test(&trees[k..]) {
            // The attribute's item ends with its braces or with a semicolon, whichever comes first.
            k += 2;
            while k < trees.len() {
                let end = match &trees[k] {
                    TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
                    TokenTree::Punct(mark) => mark.as_char() == ';',
                    _ => false,
                };
                k += 1;
                if end {
                    break;
                }
            }
            continue;
        }
        match &trees[k] {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::None => ("", ""),
                };
                push(open.to_owned(), &trees[k], out);
                let mut inner = module.to_vec();
                // `mod name { ... }` stands in a module of its own.
                if k >= 2 && trees[k - 2].to_string() == "mod" && group.delimiter() == Delimiter::Brace {
                    inner.push(trees[k - 1].to_string());
                }
                flatten_into(&group.stream(), &inner, out);
                let line = group.span_close().start().line;
                out.push(Token { text: close.to_owned(), line, module: module.to_vec() });
            }
            TokenTree::Ident(ident) => push(ident.to_string(), &trees[k], out),
            TokenTree::Punct(mark) => push(mark.as_char().to_string(), &trees[k], out),
            TokenTree::Literal(_) => push("literal".to_owned(), &trees[k], out),
        }
        k += 1;
    }
}

/// Whether the trees begin with `#[cfg(test)]`.
fn is_cfg_test(trees: &[TokenTree]) -> bool {
    match trees {
        [TokenTree::Punct(hash), TokenTree::Group(group), ..] if hash.as_char() == '#' => {
            group.to_string().replace(char::is_whitespace, "") == "[cfg(test)]"
        }
        _ => false,
    }
}

/// A path that starts with `crate` or `super`, made absolute.
#[derive(Clone, Debug, PartialEq)]
pub struct AbsolutePath {
    /// Segments below the crate's root; `["*"]` for the root itself or all of it.
    pub segments: Vec<String>,
    /// The module it stands in.
    pub module: Vec<String>,
    /// Line in its file.
    pub line: usize,
}

/// Every path through `crate` or `super`, groups of `use` opened up. A `crate` that is renamed comes out as `*`.
pub fn absolute_paths(tokens: &[Token]) -> Vec<AbsolutePath> {
    let mut paths = Vec::new();
    for start in 0..tokens.len() {
        let first = &tokens[start];
        let restricts_visibility =
            start >= 2 && tokens[start - 1].text == "(" && tokens[start - 2].text == "pub";
        let continues = start >= 1 && tokens[start - 1].text == ":";
        if restricts_visibility || (first.text != "crate" && first.text != "super") {
            continue;
        }
        // `super::super` and `self::super` are read from their first segment; `self` alone changes nothing.
        if continues && !(start >= 3 && tokens[start - 3].text == "self") {
            continue;
        }
        let mut base = if first.text == "crate" { Vec::new() } else { first.module.clone() };
        let mut at = start;
        if first.text == "super" {
            base.pop();
            while is_separator(tokens, at + 1) && tokens.get(at + 3).is_some_and(|next| next.text == "super")
            {
                base.pop();
                at += 3;
            }
        }
        let mut found = Vec::new();
        read_tree(tokens, at + 1, &base, &mut found);
        paths.extend(found.into_iter().map(|segments| AbsolutePath {
            segments,
            module: first.module.clone(),
            line: first.line,
        }));
    }
    paths
}

fn is_separator(tokens: &[Token], at: usize) -> bool {
    [at, at + 1].iter().all(|&k| tokens.get(k).is_some_and(|token| token.text == ":"))
}

/// Reads `::a::{b, c::d}` from `at`, adds the full paths, returns the position after it.
fn read_tree(tokens: &[Token], mut at: usize, base: &[String], found: &mut Vec<Vec<String>>) -> usize {
    let mut path = base.to_vec();
    while is_separator(tokens, at) {
        let Some(next) = tokens.get(at + 2) else { break };
        match next.text.as_str() {
            "{" => {
                at += 3;
                while tokens.get(at).is_some_and(|token| token.text != "}") {
                    if tokens[at].text == "," {
                        at += 1;
                        continue;
                    }
                    let mut inner = path.clone();
                    if tokens[at].text != "self" {
                        inner.push(tokens[at].text.clone());
                    }
                    at = read_tree(tokens, at + 1, &inner, found);
                    while tokens.get(at).is_some_and(|token| token.text != "," && token.text != "}") {
                        at += 1; // `as name`
                    }
                }
                return at + 1;
            }
            // Generic arguments end the path: `crate::a::b::<T>`.
            "<" => break,
            segment => {
                path.push(segment.to_owned());
                at += 3;
            }
        }
    }
    if path.is_empty() {
        path.push("*".to_owned());
    }
    found.push(path);
    at
}

/// A public function, method or associated function.
#[derive(Clone, Debug, PartialEq)]
pub struct PublicFunction {
    /// Its name, behind the name of its `impl` block's type if it has one: `Solutions::push`.
    pub name: String,
    /// The lines of its body, from the one with `{` to the one with `}`.
    pub body: std::ops::RangeInclusive<usize>,
}

/// Every `pub fn` with its body.
pub fn public_functions(tokens: &[Token]) -> Vec<PublicFunction> {
    let text = |k: usize| tokens.get(k).map_or("", |token| token.text.as_str());
    let mut found = Vec::new();
    // The type of the `impl` block around a token, with the token where the block ends.
    let mut owner: Option<(String, usize)> = None;
    for k in 0..tokens.len() {
        if owner.as_ref().is_some_and(|&(_, end)| k > end) {
            owner = None;
        }
        if text(k) == "impl"
            && owner.is_none()
            && let Some(open) = (k..tokens.len()).find(|&at| text(at) == "{")
        {
            let header: Vec<&str> = (k + 1..open).map(text).collect();
            owner = Some((implementing_type(&header), closing(tokens, open)));
        }
        if text(k) != "pub" || text(k + 1) == "(" {
            continue;
        }
        let mut at = k + 1;
        while ["const", "unsafe", "extern", "literal"].contains(&text(at)) {
            at += 1;
        }
        if text(at) != "fn" {
            continue;
        }
        let Some(open) = (at..tokens.len()).find(|&brace| text(brace) == "{") else { continue };
        let name = match &owner {
            Some((owner, _)) => format!("{owner}::{}", text(at + 1)),
            None => text(at + 1).to_owned(),
        };
        found.push(PublicFunction { name, body: tokens[open].line..=tokens[closing(tokens, open)].line });
    }
    found
}

/// The position of the brace that closes the one at `open`.
fn closing(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (k, token) in tokens.iter().enumerate().skip(open) {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ => continue,
        }
        if depth == 0 {
            return k;
        }
    }
    tokens.len() - 1
}

/// `Foo` of `impl<T: Real> Foo<T>` and of `impl<T> Trait<T> for Foo<T>`.
fn implementing_type(header: &[&str]) -> String {
    let mut depth = 0i32;
    let mut name = String::new();
    for (k, text) in header.iter().enumerate() {
        match *text {
            "<" => depth += 1,
            ">" if header[k - 1] != "-" => depth -= 1,
            "where" => break,
            _ if depth == 0 && text.starts_with(|c: char| c.is_alphabetic()) => name = (*text).to_owned(),
            _ => {}
        }
    }
    name
}
