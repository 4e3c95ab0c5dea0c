#!/usr/bin/env bash
# Draws the example graphs at 2048 cells, whole and close up, and writes docs/gallery.md:
#
#     tests/gallery/run.sh [NAME ...]
#
# With names, only these graphs are drawn again. Storms take hundreds of times as long at such cells and are drawn at their own.
# Needs ImageMagick.
set -euo pipefail
cd "$(dirname "$0")/../.."

# Graph, title, output (- for the height), cells and the north-west corner of the close-up as parts of the picture.
graphs=(
    "alps|Alps|-|2048|.42 .42"
    "himalaya|A very high range|-|2048|.40 .30"
    "fjords|A fjord coast|-|2048|.42 .35"
    "glen|A Highland glen|relief|2048|.42 .12"
    "highlands|Moors and glens|-|2048|.35 .35"
    "canyon|A canyon in layered rock|map|2048|.35 .35"
    "foldbelt|A fold belt|-|2048|.40 .55"
    "badlands|Badlands|colour|2048|.35 .45"
    "coast_range|A dissected coastal range|-|2048|.35 .35"
    "basin_and_range|Basins and ranges|colour|2048|.30 .30"
    "hello|A first range|-|2048|.35 .30"
    "ridges|Ridges and rivers|-|2048|.30 .30"
    "fault|A fault and its escarpment|map|2048|.35 .35"
    "ridge|A range for other graphs|-|2048|.35 .35"
    "two_ranges|Two ranges from one graph|-|2048|.35 .35"
    "belts|Vegetation belts|colour|2048|.35 .35"
    "painted|Painted from data|colour|2048|.35 .35"
    "road|A road across the mountains|colour|2048|.05 .45"
    "isles|Islands|colour|2048|.35 .35"
    "mesas|Mesas|colour|2048|.35 .35"
    "terraces|Terraced fields|colour|2048|.60 .25"
    "scree|Cliffs and scree|-|2048|.35 .35"
    "talus_dem|Real mountains after ten thousand cold years|after|2048|.35 .35"
    "rivers|Rivers and lakes|map|2048|.35 .35"
    "rivers_dem|The rivers of a real place|map|2048|.35 .35"
    "carve_dem|A real landscape, eroded further|after|2048|.35 .35"
    "amplify|A coarse real model with gullies and rills|after|1024|.20 .05"
    "gullies|Gullies after a storm|after|400|.60 .55"
    "flood_dem|A cloudburst over real canyons|map|512|.35 .35"
)

program=${OROGRAPH:-target/release/orograph}
[ -x "$program" ] || { echo "no $program: build it with \`cargo build --release\`, or name it in OROGRAPH"; exit 1; }
command -v convert >/dev/null || { echo "ImageMagick's convert is missing: install imagemagick"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p docs/gallery

page=docs/gallery.md
{
    echo "# Gallery"
    echo
    echo "The example graphs, whole and close up, where a pixel is a cell. \`tests/gallery/run.sh\` draws them."
} > "$folder/page"
for entry in "${graphs[@]}"; do
    IFS='|' read -r name title output cells corner <<< "$entry"
    if [ $# -eq 0 ] || printf '%s\n' "$@" | grep -qx "$name"; then
        which=()
        [ "$output" = - ] || which=(--output "$output")
        "$program" render "graphs/$name.ron" --cells "$cells" ${which[@]+"${which[@]}"} -o "$folder/$name.png"
        read -r width height < <(identify -format '%w %h\n' "$folder/$name.png")
        read -r left top <<< "$corner"
        side=$(awk -v w="$width" 'BEGIN { s = w / 3; print int(s < 640 ? s : 640) }')
        at=$(awk -v w="$width" -v h="$height" -v x="$left" -v y="$top" 'BEGIN { printf "+%d+%d", w * x, h * y }')
        convert "$folder/$name.png" -resize 640x640 \
            \( "$folder/$name.png" -crop "${side}x${side}$at" +repage -filter point -resize 640x640 \) \
            -background white -gravity center +append -quality 85 "docs/gallery/$name.jpg"
    fi
    [ -e "docs/gallery/$name.jpg" ] || continue
    {
        echo
        echo "## $title"
        echo
        echo "\`graphs/$name.ron\`, $cells cells."
        echo
        echo "![$title, whole and close up](gallery/$name.jpg)"
    } >> "$folder/page"
done
cp "$folder/page" "$page"
echo "wrote $page"
