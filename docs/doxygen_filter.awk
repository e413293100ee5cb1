# What Doxygen reads in place of a header or of a folder's CMakeLists.txt (docs/Doxyfile). Lines keep their numbers, so that
# its warnings point at the right ones.
# - The plain comment on top describes the file, or the folder.
# - A comment holds for all overloads that follow without an empty line: each gets a copy.
# - `fields` and `enum_names`, which read a type from YAML (core/yaml_reader.h), aren't shown.
FNR == 1 { top = 1; folder = FILENAME }
folder ~ /CMakeLists\.txt$/ {
  if (FNR == 1 && /^# /) { sub(/\/[^\/]*$/, "", folder); printf "/// @dir %s\n", folder; folder = FILENAME }
  top = top && sub(/^# /, "/// ")
  print top ? $0 : ""
  next
}
FNR == 1 && /^#pragma once/ { print "/// @file"; next }
top && sub(/^\/\//, "///") { print; next }
{ top = 0 }
/^(void fields\(YamlReader|EnumNames<.*> enum_names\()/ { print ""; next }
/^ *$/ { comment = name = "" }
/^ *\/\/\/ / {
  if (!inside) comment = name = ""
  inside = 1
  match($0, /^ */)
  indent = RLENGTH
  comment = comment substr($0, indent + 4)
  print
  next
}
{
  inside = 0
  match($0, /^ */)
  if (comment != "" && RLENGTH == indent && match($0, /[A-Za-z_0-9]+\(/)) {
    called = substr($0, RSTART, RLENGTH)
    if (name == "") name = called
    else if (called == name && !/&&\)|= d/) $0 = "/**" comment " */ " $0
  }
  print
}
