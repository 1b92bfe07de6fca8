# Common to tools/setup, tools/demo and tools/test (sourced by them, bash): where things are, and steps with a log.
#   LIBLOC_BUILD_DIR  build folders are made in it        (default: build/ of the checkout)
#   LIBLOC_VENV       Python environment                  (default: .venv/ of the checkout)
#   LIBLOC_PYTHON     interpreter that the environment is made with (default: Debian's /usr/bin/python3)
#   JOBS              compiler processes at a time        (default: one per processor)
# Everything is written inside the checkout, caches included; only the Debian packages go elsewhere.
set -o pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
cache_dir=$root/.cache
log_dir=$cache_dir/log
build_root=$(realpath -m -- "${LIBLOC_BUILD_DIR:-$root/build}")
venv=$(realpath -m -- "${LIBLOC_VENV:-$root/.venv}")
base_python=${LIBLOC_PYTHON:-/usr/bin/python3}
python=$venv/bin/python
jobs=${JOBS:-$(nproc)}

# Caches of other programs would land in the user's home.
export CCACHE_DIR=${CCACHE_DIR:-$cache_dir/ccache}
# Precompiled headers are cached too (LOC_PRECOMPILED_TESTS).
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}
export PIP_CACHE_DIR=${PIP_CACHE_DIR:-$cache_dir/pip}
export MPLCONFIGDIR=${MPLCONFIGDIR:-$cache_dir/matplotlib}
export MPLBACKEND=Agg
export PIP_DISABLE_PIP_VERSION_CHECK=1

# A command that ends tidily on Ctrl-C must not let the script go on.
trap 'printf "\n%s: interrupted; start again to go on\n" "$(basename "$0")" >&2; exit 130' INT
trap 'exit 143' TERM

say() { printf '%s\n' "$*"; }
die() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

[[ $jobs =~ ^[1-9][0-9]*$ ]] || die "JOBS=$jobs: a whole number above 0 is needed"
mkdir -p "$log_dir" "$CCACHE_DIR" 2>/dev/null && [[ -w $cache_dir ]] || die "cannot write in $cache_dir: the checkout has to be writable"

# What a log of a failed step says about the reason; nothing when it is not one of the usual ones.
reason_of_failure() {
  if grep -qiE 'no space left|not enough free space|disk quota' "$1"; then
    say "  reason: the disk is full ($(df -h --output=avail "$root" | tail -1 | tr -d ' ') free in $root)"
  elif grep -qiE 'temporary failure resolving|could not resolve|name or service not known|name resolution|network is unreachable|connection (timed out|refused)|failed to establish a new connection|could not connect|unable to connect|no route to host' "$1"; then
    say "  reason: no network, or the server cannot be reached (a proxy is taken from http_proxy and https_proxy)"
  elif grep -qiE 'certificate.verify.failed|SSLError' "$1"; then
    say "  reason: the server's certificate is not trusted (behind a proxy that re-signs: set PIP_CERT, SSL_CERT_FILE)"
  elif grep -qiE 'killed|out of memory|cannot allocate memory' "$1"; then
    say "  reason: perhaps too little memory; try JOBS=1"
  elif grep -qi 'dpkg was interrupted' "$1"; then
    say "  reason: an earlier installation was interrupted; run: dpkg --configure -a"
  fi
}

# Shows the last line of what comes in, overwriting it; everything goes to the file.
last_line_to_terminal() {
  local label=$1 file=$2 line width
  width=$(tput cols 2>/dev/null || echo 80)
  : >"$file"
  while IFS= read -r line || [[ -n $line ]]; do
    printf '%s\n' "$line" >>"$file"
    line="$label: ${line//[$'\t\r\e']/ }"
    printf '\r\e[K%s' "${line:0:width-1}"
  done
  printf '\r\e[K'
}

# step LABEL COMMAND…: runs it with its output in a log and says how long it took. When it fails: the end of the log, the
# reason when it is a usual one, and the command's exit code.
step() {
  local label=$1 start=$SECONDS code file
  shift
  file=$log_dir/${label//[^A-Za-z0-9]/_}.log
  if [[ -t 1 ]]; then
    "$@" 2>&1 </dev/null | last_line_to_terminal "$label" "$file"
    code=${PIPESTATUS[0]}
  else
    printf '%s: ' "$label"
    "$@" >"$file" 2>&1 </dev/null
    code=$?
  fi
  [[ ! -t 1 ]] || printf '%s: ' "$label"
  if ((code == 0)); then
    say "$((SECONDS - start)) s"
  else
    say "FAILED after $((SECONDS - start)) s (exit code $code). The end of $file:"
    tail -n "${step_tail_lines:-25}" "$file" | sed 's/^/  | /'
    reason_of_failure "$file"
  fi
  return "$code"
}

# cmake_configure FOLDER OPTION…: makes or updates a build folder; one that came from another place is made anew.
cmake_configure() {
  local folder=$1 fresh=()
  shift
  if [[ -f $folder/CMakeCache.txt ]] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$folder/CMakeCache.txt"; then
    fresh=(--fresh)
  fi
  if command -v ccache >/dev/null; then
    set -- "$@" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache
  fi
  cmake "${fresh[@]}" -S "$root" -B "$folder" -G Ninja "$@"
}
