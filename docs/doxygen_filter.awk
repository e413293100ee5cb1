# What Doxygen reads in place of a header, of a folder's CMakeLists.txt, or of a page in Markdown (docs/Doxyfile). Lines keep
# their numbers, so that its warnings point at the right ones.
# - The plain comment on top describes the file, or the folder.
# - Indented lines of a comment, but for those of a list or of @throws and the like, are shown as they are.
# - A comment holds for all overloads that follow without an empty line: each gets a copy.
# - `fields` and `enum_names`, which read a type from YAML (core/yaml_reader.h), aren't shown.
# - In pages, a link to a heading leads to its page: Doxygen 1.9.4 doesn't know GitHub's names of headings.

# Prints one line late, so that what follows can still be marked in it.
function show(line) {
  if (held != "" || FNR > 1) print held
  held = line
}

function close_verbatim() {
  if (verbatim) held = held " @endverbatim"
  verbatim = 0
}

FNR == 1 { top = 1 }
FILENAME ~ /\.md$/ {
  while (match($0, /\[[^]]*\]\(#[^)]*\)/)) {
    text = substr($0, RSTART + 1, index(substr($0, RSTART), "]") - 2)
    $0 = substr($0, 1, RSTART - 1) text substr($0, RSTART + RLENGTH)
  }
  gsub(/\.md#[^)]*\)/, ".md)")
  show($0)
  next
}
FILENAME ~ /CMakeLists\.txt$/ {
  folder = FILENAME
  sub(/\/[^\/]*$/, "", folder)
  top = top && sub(/^# /, "/// ")
  if (FNR == 1) held = "/// @dir " folder
  show(top ? $0 : "")
  next
}
FNR == 1 && /^#pragma once/ { show("/// @file"); next }
top && !sub(/^\/\//, "///") { top = 0 }
/^(void fields\(YamlReader|EnumNames<.*> enum_names\()/ { $0 = "" }
/^ *$/ { comment = name = "" }

/^ *\/\/\/( |$)/ {
  if (!inside) comment = name = ""
  inside = 1
  match($0, /^ */)
  indent = RLENGTH
  text = substr($0, indent + 4)
  comment = comment text
  if (text == "") list = 0
  else if (text ~ /@(throws|pre|param)/) list = 2
  else if (list < 2 && text !~ /^   /) list = text ~ /^ *(-|[0-9]+\.) /
  else if (text ~ /^ *(-|[0-9]+\.) /) list = 1
  if (text ~ /^   +[^ ]/ && !list) {
    if (!verbatim) held = held " @verbatim"
    verbatim = 1
    $0 = text
  } else if (text != "") {
    close_verbatim()
  }
  show($0)
  next
}
{
  close_verbatim()
  inside = list = 0
  match($0, /^ */)
  if (comment != "" && RLENGTH == indent && match($0, /[A-Za-z_0-9]+\(/)) {
    called = substr($0, RSTART, RLENGTH)
    if (name == "") name = called
    else if (called == name && !/&&\)|= d/) $0 = "/**" comment " */ " $0
  }
  show($0)
}
END { print held }
