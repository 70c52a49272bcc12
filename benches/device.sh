#!/usr/bin/env bash
# What a graphics device does in bakes, on a machine with neither Rust nor a network.
#
#     benches/device.sh FOLDER OUT [SECONDS]
#
# FOLDER holds what was built beforehand, `radiosity` (the program, --features cli) and `device`
# (the bench of that name), and scenes: NAME.obj with their libraries and, where there are any,
# NAME.truth.json and compare.py, which needs numpy; make_city.py for cities. OUT gets a report of
# each bake and `device.tsv`. Nothing new is begun after SECONDS, 330 unless given.
set -u
folder=$1 out=$2 limit=${3:-330}
mkdir -p "$out"
start=$(date +%s)
left() { echo $((limit - $(date +%s) + start)); }

"$folder/device" | tee "$out/device.tsv"

# scene, error
bake() {
    local name=$1 error=$2
    [ -f "$folder/$name.obj" ] || return 0
    for device in "" --cpu; do
        [ "$(left)" -gt 0 ] || return 0
        local stem="$out/${name}_${device:-gpu}"
        timeout 40 "$folder/radiosity" bake "$folder/$name.obj" --error "$error" $device \
            --write ply,json --out "$stem" >"$stem.log" 2>&1
        echo "bake $name $error ${device:-gpu}: status $?"
        grep -E "^(adapter|mesh|shooting|gathering|error|seconds)|reached|missed" "$stem.log" |
            sed 's/^/    /'
        if [ -f "$folder/$name.truth.json" ] && [ -f "$stem.ply" ]; then
            python3 "$folder/compare.py" "$stem.ply" "$folder/$name.truth.json" \
                --floor 0.05 --trim 0.01 | tail -1 | sed 's/^/    /'
        fi
    done
}
bake cornell 0.01
bake two_room 0.01
bake detail_room 0.05
bake hall 0.1
bake vk_viking_room 0.1
bake drone_city 0.1
if [ -f "$folder/make_city.py" ]; then
    for triangles in 200000 1000000; do
        [ "$(left)" -gt 40 ] || break
        [ -f "$folder/city$triangles.obj" ] ||
            (cd "$folder" && python3 make_city.py $triangles city$triangles)
        bake city$triangles 0.1
    done
fi
