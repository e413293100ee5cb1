# What Doxygen reads in place of a header or a folder's CMakeLists.txt (docs/Doxyfile): the plain comment on top becomes the
# description of the file, or of the folder. Lines keep their numbers, so warnings point at the right ones.
FNR == 1 { top = 1 }
FNR == 1 && FILENAME ~ /CMakeLists\.txt$/ {
  folder = FILENAME
  sub(/\/[^\/]*$/, "", folder)
  if (/^# /) printf "/// @dir %s\n", folder
  cmake = 1
}
cmake {
  if (top && sub(/^# /, "/// ")) print
  else top = 0
  next
}
FNR == 1 && /^#pragma once/ { print "/// @file"; next }
top && sub(/^\/\//, "///") { print; next }
{ top = 0; print }
