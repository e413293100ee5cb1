#!/usr/bin/env bash
# Reads the #includes of every folder and fails on an arrow that isn't on the list of docs/ARCHITECTURE.md.
set -euo pipefail
cd "$1"

declare -A allowed=(
  [core]="core"
  [fem]="core fem"
  [render]="core render"
  [sensors]="core sensors"
  [sim]="core fem render sim"
  [lab]="core fem render sensors sim lab"
  [apps]="core fem render sensors sim lab apps"
  [python]="core fem render sensors sim lab python"
  [testing]="core sim lab testing"
)
folders=$(printf '%s|' "${!allowed[@]}")
folders=${folders%|}
wrong=0
seen=0
for folder in "${!allowed[@]}"; do
  while IFS=: read -r file line text; do
    seen=$((seen + 1))
    [[ $text =~ \"([a-z_]+)/ ]]  # not sed: a process for each of some thousand lines takes a minute
    target=${BASH_REMATCH[1]}
    case " ${allowed[$folder]} " in
      *" $target "*) ;;
      *)
        echo "$file:$line: $folder/ must not include $target/: $text"
        wrong=$((wrong + 1))
        ;;
    esac
  done < <(grep -rnE --include='*.h' --include='*.cpp' "^#include \"($folders)/" "$folder" || true)
done

# The estimators must not know the simulator's libraries, and Embree stays in two files: single rays and packets.
check_absent() {
  local pattern=$1 where=$2 except=$3
  if grep -rnE --include='*.h' --include='*.cpp' "$pattern" $where | grep -v "$except"; then
    wrong=$((wrong + 1))
  fi
}
check_absent '#include <(embree3|tetgen|dmumps|OpenImageIO|cholmod)' "sensors core" '^$'
check_absent '#include <embree3' "fem render sim lab apps python" '^render/\(ray_scene\|packet_scene\)\.'

[ "$seen" -gt 0 ] || { echo "no include was read: the test looks at the wrong folder"; exit 1; }
[ "$wrong" -eq 0 ] || { echo "$wrong wrong arrows"; exit 1; }
echo "$seen includes, all along the arrows"
