# Which sources may be compiled as one: prints "GROUP FILE" for each .cpp file given. Files of a group declare no name twice in
# their anonymous namespaces, where each thinks itself alone. A file stays alone where a header that is given defines a
# constant or an inline function of a name that it uses for its own, in the same namespace: names of outer ones are
# hidden by the file's. -v most=N: files of a group at most.
#
# What counts as declared: at a line's begin within "namespace {" ... "}  // namespace", the name of a type, an alias, a
# function or its operator's, variables, and the members of an enum that isn't a class; of GoogleTest's TEST(A, B) the
# class that it makes. Files may say "using a::b" of the same a::b, and give the same alias to the same type or namespace.
function declare(name) {
  if (name != "" && !((FILENAME, name) in declared)) {
    declared[FILENAME, name] = space
    names[FILENAME] = names[FILENAME] " " name
  }
}
function declare_all(text,    word) {
  while (match(text, /[A-Za-z_][A-Za-z_0-9]*/)) {
    word = substr(text, RSTART, RLENGTH)
    declare(word)
    text = substr(text, RSTART + RLENGTH)
  }
}
function clash(group, name,    part) {
  if (split(name, part, "|") == 3) return (group, part[2]) in taken && taken[group, part[2]] != part[3]
  return (group, name) in taken
}
function take(group, name,    part) {
  if (split(name, part, "|") == 3) taken[group, part[2]] = part[3]
  else taken[group, name] = ""
}
FNR == 1 { space = "" }
/^namespace [A-Za-z_0-9:]+ \{/ && !inside { space = $2 }
FILENAME ~ /\.h$/ {
  if (match($0, /^inline constexpr [^=({]*[ >]k[A-Z][A-Za-z_0-9]*/)) {
    name = substr($0, RSTART, RLENGTH); sub(/.*[^A-Za-z_0-9]/, "", name); public[space, name] = 1
  } else if (/^inline [^(={]*\(/) {
    name = $0; sub(/\(.*/, "", name); sub(/.*[^A-Za-z_0-9]/, "", name); public[space, name] = 1
  }
  next
}
FNR == 1 { inside = 0; in_enum = 0; files[++count] = FILENAME }
/^namespace \{/ { inside = 1; next }
/^\}  \/\/ namespace$/ { inside = 0; next }
!inside { next }
in_enum { line = $0; sub(/\/\/.*/, "", line); if (line ~ /\}/) in_enum = 0; declare_all(line); next }
/^static_assert/ { next }
/^[A-Za-z_]/ {
  line = $0
  sub(/\/\/.*/, "", line)
  sub(/^template *<[^>]*> */, "", line)
  if (line ~ /^(struct|class|union|enum class) /) {
    sub(/^(struct|class|union|enum class) /, "", line)
    match(line, /^[A-Za-z_0-9]+/); declare(substr(line, RSTART, RLENGTH)); next
  }
  if (line ~ /^enum /) { in_enum = line !~ /\}/; sub(/^enum /, "", line); sub(/:[^{]*/, "", line); declare_all(line); next }
  if (line ~ /^(using|namespace) [A-Za-z_0-9]+ *=/) {
    whole = line ~ /;/
    sub(/^(using|namespace) /, "", line); sub(/;.*/, "", line); gsub(/ /, "_", line)
    name = line; sub(/_*=.*/, "", name); sub(/^[^=]*=/, "=", line); declare(whole ? "using|" name "|" line : name); next
  }
  if (line ~ /^using /) {
    sub(/;.*/, "", line); sub(/^using +(::)?(touchstone::)?/, "", line); gsub(/ /, "_", line)
    name = line; sub(/.*:/, "", name); declare("using|" name "|" line); next
  }
  if (line ~ /^(TYPED_)?TEST(_F|_P)?\(/) {
    sub(/^[A-Z_]*\( */, "", line); sub(/\).*/, "", line); sub(/, */, "_", line); declare(line "_Test"); next
  }
  if (line ~ /^[A-Z_]*TEST_SUITE[A-Z_]*\(/) { sub(/^[A-Z_]*\( */, "", line); sub(/[,)].*/, "", line); declare("suite:" line); next }
  head = line
  sub(/[({=;].*/, "", head)          # up to what begins arguments or a value
  if (line ~ /^[^=;{]*\(/) { sub(/ +$/, "", head); sub(/.*[^A-Za-z_0-9]/, "", head); declare(head); next }
  sub(/\[.*/, "", head); sub(/ +$/, "", head); sub(/.*[^A-Za-z_0-9]/, "", head); declare(head)
  rest = line                         # constexpr double kA = 1.0, kB = 2.0;
  while (match(rest, /, *[A-Za-z_][A-Za-z_0-9]* *[={]/)) {
    word1 = substr(rest, RSTART, RLENGTH); rest = substr(rest, RSTART + RLENGTH)
    gsub(/[^A-Za-z_0-9]/, "", word1); declare(word1)
  }
}
END {
  for (f = 1; f <= count; ++f) {
    n = split(names[files[f]], own, " ")
    alone = 0
    for (i = 1; i <= n; ++i) if ((declared[files[f], own[i]], own[i]) in public) alone = 1
    if (alone) { print "alone" f, files[f]; continue }
    for (g = 1; ; ++g) {
      if (size[g] >= most) continue
      free = 1
      for (i = 1; i <= n && free; ++i) if (clash(g, own[i])) free = 0
      if (free) break
    }
    ++size[g]
    for (i = 1; i <= n; ++i) take(g, own[i])
    print g, files[f]
  }
}
