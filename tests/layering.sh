#!/usr/bin/env bash
# Reads the #includes of every folder, and of the tests of every folder, and fails on an arrow that isn't on the list
# below. Each row is a folder and what it may include besides itself; rows stand in the order of their arrows, so a
# folder may only name those above it.
set -euo pipefail
cd "$1"

rows=$(cat <<'END'
core:
closed_forms: core
plots: core
fem/mesh: core
fem/elements: core fem/mesh
fem/shapes: core fem/mesh
fem/contact: core fem/mesh fem/elements fem/shapes
fem/finite_strain: core fem/elements fem/shapes fem/contact
fem/error: core fem/mesh fem/elements fem/contact
fem/fine_relief: core fem/elements fem/shapes fem/contact
fem/vibration: core fem/elements fem/contact
render/spectra: core
render/sampling: core
render/materials: core render/spectra render/sampling
render/scene: core render/spectra render/sampling render/materials
render/lamps: core render/spectra render/sampling render/materials render/scene
render/cameras: core render/spectra render/sampling render/materials render/scene
render/paths: core render/spectra render/sampling render/materials render/scene render/lamps render/cameras
render/direct: core render/spectra render/sampling render/materials render/scene render/lamps render/cameras render/paths
render/membrane: core render/sampling render/materials render/scene render/lamps render/cameras render/paths
render/imager: core render/spectra render/sampling
render/events: core
sensors/numerics: core
sensors/models: core
sensors/learning: core sensors/numerics sensors/models
sensors/image: core sensors/numerics
sensors/beads: core sensors/numerics sensors/models sensors/image
sensors/heights: core sensors/numerics sensors/models sensors/learning sensors/image
sensors/touch_map: core sensors/models
sensors/texture: core sensors/models sensors/image
sensors/markers: core sensors/models sensors/image sensors/heights
sensors/colour: core sensors/models sensors/image sensors/markers
sensors/tractions: core sensors/numerics sensors/models sensors/beads sensors/markers sensors/colour
sensors/events: core sensors/models sensors/learning
sensors/reflex: core sensors/models
sensors/skin: core sensors/models sensors/learning sensors/events
sim/files: core fem/mesh render/spectra
sim/relief: core fem/shapes sim/files
sim/scene: core fem/mesh fem/elements fem/shapes fem/contact fem/fine_relief render/materials render/scene render/cameras render/imager render/events sim/files sim/relief
sim/plan: core fem/contact fem/fine_relief fem/vibration sim/files sim/scene
sim/press: core fem/mesh fem/elements fem/shapes fem/contact fem/finite_strain fem/error fem/vibration sim/files sim/scene sim/plan
sim/view: core fem/mesh fem/elements fem/shapes fem/contact fem/fine_relief render/scene render/cameras render/paths sim/files sim/scene sim/plan
sim/sensor: core fem/elements fem/shapes fem/contact fem/error fem/fine_relief fem/vibration render/spectra render/scene render/cameras render/paths render/direct render/membrane render/imager render/events sim/files sim/scene sim/plan sim/press sim/view
sim/need: core fem/mesh fem/elements fem/contact fem/finite_strain render/paths render/imager sim/scene sim/plan sim/press sim/view sim/sensor
sim/cost: core fem/mesh fem/elements fem/shapes fem/contact fem/finite_strain fem/error render/cameras render/paths render/imager sim/files sim/scene sim/plan sim/press sim/view sim/sensor
sim/grasp: core fem/mesh fem/elements fem/contact fem/error fem/fine_relief fem/vibration sim/scene sim/press
datasets/jobs: core render/lamps sim/relief sim/scene sim/plan sim/press sim/sensor sim/need
datasets/sets: core fem/elements sensors/events sim/files sim/scene sim/plan sim/need sim/press sim/view sim/sensor sim/cost datasets/jobs
datasets/sources: core sensors/events sim/files datasets/jobs datasets/sets
datasets/inspection: core plots render/cameras render/imager sim/files sim/scene sim/plan sim/view datasets/jobs datasets/sets
datasets/exports: core sim/files datasets/sets datasets/inspection
lab/statistics: core
lab/validation: core plots fem/error sim/scene sim/sensor lab/statistics
lab/press: core fem/elements fem/shapes fem/contact fem/finite_strain render/scene render/cameras sensors/tractions sim/scene
lab/mechanics: core closed_forms fem/mesh fem/elements fem/contact fem/vibration sim/scene sim/plan sim/press lab/statistics lab/validation lab/press
lab/light: core closed_forms render/paths render/imager lab/validation
lab/device: core render/imager sim/scene sim/plan sim/view sim/sensor datasets/sets
lab/vhs: core closed_forms fem/elements fem/contact render/materials render/scene render/cameras sensors/learning sensors/beads sensors/colour sensors/tractions sensors/events sensors/skin sim/files sim/scene sim/plan sim/press sim/view sim/sensor sim/grasp datasets/jobs datasets/sets datasets/sources datasets/inspection lab/statistics lab/validation lab/press lab/mechanics
lab/gelsight: core closed_forms fem/shapes fem/contact sensors/heights sensors/touch_map sensors/texture sensors/markers sim/files sim/scene sim/sensor sim/grasp datasets/sets datasets/sources datasets/inspection lab/validation
lab/dtact: core sensors/heights sim/files datasets/sets datasets/sources datasets/inspection lab/gelsight
lab/chroma: core plots fem/contact fem/finite_strain render/spectra render/scene render/cameras render/paths render/imager sensors/colour sensors/tractions sim/scene sim/plan sim/press sim/view sim/sensor datasets/sets datasets/sources datasets/inspection lab/statistics lab/validation lab/press lab/gelsight
lab/dvs: core render/membrane render/events sensors/learning sensors/events sim/scene sim/press sim/sensor sim/grasp datasets/sets datasets/sources datasets/inspection lab/validation
lab/reflex: core fem/contact fem/finite_strain render/cameras render/paths render/direct render/imager sensors/reflex sim/files sim/scene sim/plan sim/press sim/view datasets/sets datasets/sources datasets/inspection lab/validation
lab/studies: core plots fem/mesh fem/elements fem/shapes fem/contact render/sampling render/imager sensors/beads sensors/tractions sim/scene sim/plan sim/press sim/view sim/sensor datasets/jobs lab/validation lab/press lab/vhs lab/chroma
lab/bench: core plots fem/mesh fem/elements fem/shapes fem/contact fem/error render/cameras render/imager sensors/beads sensors/heights sim/files sim/scene sim/plan sim/press sim/view sim/sensor sim/need sim/cost datasets/sets lab/statistics lab/vhs lab/gelsight lab/studies
lab/likeness: core render/imager sensors/heights sim/files sim/scene sim/sensor datasets/sets datasets/inspection lab/gelsight
lab/fit: core render/imager sensors/heights sim/files sim/relief sim/scene sim/press sim/view sim/sensor datasets/jobs datasets/sets datasets/inspection lab/validation lab/gelsight lab/studies lab/likeness
lab/schema: core sim/scene datasets/jobs lab/vhs lab/studies lab/fit
apps: core plots render/imager sensors/tractions sensors/events sim/files sim/scene sim/plan sim/press sim/view sim/sensor sim/need sim/cost datasets/jobs datasets/sets datasets/sources datasets/exports datasets/inspection lab/validation lab/press lab/device lab/dvs lab/studies lab/bench lab/likeness lab/fit lab/schema
apps/estimators: core sensors/beads sensors/heights sensors/touch_map sensors/texture sensors/markers sensors/colour sensors/tractions sensors/events sensors/reflex sensors/skin sim/files datasets/sets datasets/sources lab/vhs lab/gelsight lab/dtact lab/chroma lab/dvs lab/reflex apps
python: core sensors/learning sensors/beads sensors/heights sensors/touch_map sensors/texture sensors/markers sensors/colour sensors/events sensors/reflex sensors/skin sim/files sim/scene sim/press sim/sensor datasets/jobs datasets/sets datasets/sources
testing: core sim/files sim/press sim/sensor datasets/jobs lab/device
END
)

declare -A allowed
declare -A below  # a top folder and all top folders that its subfolders point to: what its tests may include
wrong=0
seen=0
order=" "
while IFS=: read -r folder names; do
  for name in $names; do
    case "$order" in
      *" $name "*) ;;
      *) echo "tests/layering.sh: $folder may not point to $name, which stands below it or isn't there"; wrong=$((wrong + 1)) ;;
    esac
  done
  order="$order$folder "
  [ -d "$folder" ] || { echo "tests/layering.sh: there is no folder $folder"; wrong=$((wrong + 1)); }
  allowed[$folder]=" $folder $names "
  top=${folder%%/*}
  below[$top]="${below[$top]:- core closed_forms } $top/ $(printf '%s\n' $names | sed 's#/.*##; s#$#/#' | tr '\n' ' ')"
done <<<"$rows"

declare -A tests_of=([golden]=" core render/ sim/ " [hard_cases]=" core closed_forms fem/ render/ sensors/ sim/ "
  [fuzz]=" core fem/ render/ sensors/ sim/ datasets/ lab/ apps " [support]=" core fem/ sim/ datasets/ ")

# What `folder` may include, if `target` is that.
may_include() {
  local folder=$1 target=$2
  if [[ $folder == tests/* ]]; then
    [[ $target == tests/* ]] && return 0
    local of=${folder#tests/}
    of=${of%%/*}
    local list=${tests_of[$of]:-${below[$of]:-}}
    [[ $list == *" $target "* || $list == *" ${target%%/*}/ "* ]]
  else
    [[ ${allowed[$folder]:-} == *" $target "* ]]
  fi
}

tops=$(printf '%s\n' "${!below[@]}" | paste -sd'|')
declare -A known
while IFS=: read -r file line text; do
  seen=$((seen + 1))
  [[ $text =~ \"([a-z_/0-9]+)/[a-z_0-9]+\.h ]] || continue  # not sed: a process for each line takes a minute
  target=${BASH_REMATCH[1]}
  folder=${file%/*}
  case $folder in python/* | testing/*) folder=${folder%%/*} ;; esac
  case $target in python/* | testing/*) target=${target%%/*} ;; esac
  key="$folder>$target"
  if [ -z "${known[$key]:-}" ]; then
    if may_include "$folder" "$target"; then known[$key]=yes; else known[$key]=no; fi
  fi
  if [ "${known[$key]}" = no ]; then
    echo "$file:$line: $folder/ must not include $target/: $text"
    wrong=$((wrong + 1))
  fi
done < <(grep -rnE --include='*.h' --include='*.cpp' "^#include \"($tops|tests)/" $(printf '%s ' "${!below[@]}") tests || true)

# The estimators must not know the simulator's libraries, and Embree stays in two files: single rays and packets.
check_absent() {
  local pattern=$1 where=$2 except=$3
  if grep -rnE --include='*.h' --include='*.cpp' "$pattern" $where | grep -v "$except"; then
    wrong=$((wrong + 1))
  fi
}
check_absent '#include <(embree3|tetgen|dmumps|OpenImageIO|cholmod)' "sensors core" '^$'
check_absent '#include <embree3' "fem render sim datasets lab apps python" '^render/scene/\(ray_scene\|packet_scene\)\.'

[ "$seen" -gt 0 ] || { echo "no include was read: the test looks at the wrong folder"; exit 1; }
[ "$wrong" -eq 0 ] || { echo "$wrong wrong arrows"; exit 1; }
echo "$seen includes, all along the arrows"
