#!/usr/bin/env bash
# Makes the page, web/dist, and what the package needs, web/pkg. Needs Rust with the target
# wasm32-unknown-unknown, and Node.
set -euo pipefail
cd "$(dirname "$0")"

[ -d node_modules ] || npm ci --silent
target=${CARGO_TARGET_DIR:-../target}
cargo build --locked --release --target wasm32-unknown-unknown -p radiosity-web \
    --config 'target.wasm32-unknown-unknown.rustflags=["-C", "target-feature=+simd128"]'
cargo run --locked --release --quiet -p radiosity-web-bindgen -- \
    "$target/wasm32-unknown-unknown/release/radiosity_web.wasm" pkg

rm -rf dist
mkdir dist
# The glue of wasm-bindgen names a module once for each raw import.
npx esbuild page/main.js js/worker.js --bundle --format=esm --minify --target=es2022 --external:node:fs/promises \
    --outdir=dist --entry-names='[name]' --log-level=warning --log-override:duplicate-object-key=silent
cp pkg/radiosity_bg.wasm dist/radiosity.wasm
cp page/index.html page/style.css ../scenes/cornell_box.obj ../scenes/cornell_box.mtl dist
node -e '
    const fs = require("fs"), { brotliCompressSync } = require("zlib");
    const size = (file) => brotliCompressSync(fs.readFileSync(`dist/${file}`)).length;
    const total = fs.readdirSync("dist").map(size).reduce((a, b) => a + b);
    console.log(`dist: ${total} bytes compressed (brotli)`);
    if (total > 2.5e6) throw "more than 2.5 MB";'
