#!/usr/bin/env bash
# Holds what is cited, as in [KEY, sec. 3], against docs/references.md: every key that is cited has an entry there, every
# entry is cited somewhere, and no file names a source by where it once lay on somebody's disk.
set -euo pipefail
export LC_ALL=C
cd "$1"

list=docs/references.md
key='[A-Z][A-Za-z]+[0-9]{2,5}[a-z]?'
everywhere=(-rI --exclude-dir=.git --exclude-dir='build*' --exclude-dir=out --exclude-dir=.cache .)
wrong=0
complain() {
  echo "tests/citations.sh: $1"
  wrong=$((wrong + 1))
}

entries=$(sed -nE "s/^- \[($key)\] .*/\1/p" "$list")
[ -n "$entries" ] || complain "$list has no entries"
for twice in $(sort <<<"$entries" | uniq -d); do complain "$list has two entries $twice"; done

# A bracket, a key, and what ends it: the bracket, a comma before the section, or the line. "](" is a link.
cited=$(grep -noE "\[$key(\]\(?|[,;]|$)" --exclude="${list##*/}" "${everywhere[@]}" | grep -v ']($' || true)
while IFS=: read -r file line text; do
  case $text in
    *';') complain "$file:$line: $text names more sources than one; each has brackets of its own" ;;
  esac
done < <(grep ';$' <<<"$cited" || true)
keys_of() { sed -E 's/^[^:]*:[0-9]+:\[//; s/[],;]$//'; }
known=$(sort -u <<<"$entries")
for missing in $(keys_of <<<"$cited" | sort -u | comm -23 - <(printf '%s\n' "$known")); do
  complain "$(grep -m1 -F "[$missing" <<<"$cited"): $list has no entry $missing"
done
for unused in $(keys_of <<<"$cited" | sort -u | comm -13 - <(printf '%s\n' "$known")); do
  complain "$list: nothing cites $unused"
done

# Brackets in the pattern keep it from finding itself.
while IFS= read -r place; do
  complain "$place: name the source by its key in $list"
done < <(grep -nE '\<[Ss]eed[s]? 00[0-9]|\<[Tt]ext[s]? 00[0-9]|\<share[d]/|\<SENSOR[S]\.md|\<DESIG[N]\.md' "${everywhere[@]}" || true)

if [ "$wrong" -ne 0 ]; then
  echo "tests/citations.sh: $wrong wrong"
  exit 1
fi
