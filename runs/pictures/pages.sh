#!/usr/bin/env bash
# The README's pictures of pages; needs Chromium (Debian: chromium-headless-shell).
#
# tolstat run runs/stack-up.toml && tolstat report runs/stack-up.h5
# tolstat run runs/gaps.toml && tolstat report runs/gaps.h5
# tolstat run runs/khpt75.toml && tolstat report runs/khpt75.h5
# tolstat run runs/khpt75-equalized.toml && tolstat report runs/khpt75-equalized.h5
# tolstat compare runs/khpt75.h5 runs/khpt75-equalized.h5 -o runs/comparison.html
# tolstat trial runs/khpt75.h5 962 --animate runs/trial-962.html
# bash runs/pictures/pages.sh
set -euo pipefail
cd "$(dirname "$0")/.."

shoot() { # page, picture, height
    chromium-headless-shell --no-sandbox --disable-gpu --hide-scrollbars \
        --force-prefers-reduced-motion \
        --window-size="1180,$3" --screenshot="pictures/$2" "file://$PWD/$1" 2>/dev/null
}

shoot stack-up.html stack-up.png 1460
shoot gaps.html gaps.png 1383
shoot khpt75.html report.png 1480
shoot khpt75-equalized.html report-equalized.png 1066
shoot comparison.html comparison.png 1010
shoot trial-962.html animation.png 1030
