# What the scripts share; sourced, not run.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

fail() {
  echo "error: $*" >&2
  exit 1
}

# The commit whose files are here, unchanged and no others beside them; nothing
# where there are changes, or no git.
clean_commit() {
  local changes
  if [[ -e "$root/.git" ]] && command -v git >/dev/null &&
    changes="$(git -C "$root" status --porcelain)" && [[ -z "$changes" ]]; then
    git -C "$root" rev-parse HEAD
  fi
}

# What .ci/run passed on last, for scripts/release: a line with the commit. It
# begins by begin_ci and ends, where nothing was left out, by end_ci, which notes
# a commit that was clean all the time.
ci_passed="$root/build/ci-passed"
begin_ci() {
  rm -f "$ci_passed"
  ci_commit="$(clean_commit)"
}
end_ci() {
  if [[ -n "$ci_commit" && "$(clean_commit)" == "$ci_commit" ]]; then
    mkdir -p "$root/build"
    echo "$ci_commit" >"$ci_passed"
  fi
}

# configure_and_build PRESET [TARGET...]: one line of progress; the whole output
# goes to build/PRESET.log and is shown only where it fails.
configure_and_build() {
  local preset="$1"
  shift
  local log="$root/build/$preset.log"
  local start=$SECONDS
  mkdir -p "$root/build"
  cd "$root"

  echo "configuring build/$preset"
  if ! cmake --preset "$preset" >"$log" 2>&1; then
    tail -n 30 "$log" >&2
    fail "cmake could not configure; the whole log is $log"
  fi

  local -a targets=()
  if (($# > 0)); then
    targets=(--target "$@")
  fi
  if ! NINJA_STATUS='[%f/%t] ' cmake --build --preset "$preset" \
      --parallel "$(nproc)" "${targets[@]}" 2>&1 |
      tee -a "$log" | show_progress "building build/$preset"; then
    # From the first failure on; ninja finishes what runs beside it.
    if grep -q '^FAILED:' "$log"; then
      awk '/^FAILED:/ { on = 1 } on && n++ < 60' "$log" >&2
    else
      tail -n 5 "$log" >&2
    fi
    fail "the build failed; the whole log is $log"
  fi
  echo "built build/$preset in $((SECONDS - start)) s"
}

# Reads ninja's lines; on a terminal a live line, elsewhere one every tenth, with
# the time that is left if the rest goes as fast as what is done.
show_progress() {
  local title="$1" line tenth last_tenth=0 start=$SECONDS made all left
  while IFS= read -r line; do
    [[ "$line" =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    made=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
    ((made > 0)) || continue  # "[0/2] Re-checking globbed directories..."
    tenth=$((10 * made / all))
    left=$(((SECONDS - start) * (all - made) / made))
    left="about $((left / 60)) min $((left % 60)) s left"
    if [[ -t 1 ]]; then
      printf '\r%s: %s/%s, %s\e[K' "$title" "$made" "$all" "$left"
      last_tenth=1
    elif ((tenth > last_tenth)); then
      echo "$title: $made/$all, $left"
      last_tenth=$tenth
    fi
  done
  if [[ -t 1 ]] && ((last_tenth > 0)); then
    echo
  fi
}

# The presets that have tests: "known: debug release ".
test_presets() {
  echo "known: $(cd "$root" && ctest --list-presets |
    sed -n 's/^ *"\([^"]*\)".*/\1/p' | tr '\n' ' ')"
}

# run_tests PRESET [CTEST ARGUMENT...]: a line a test in build/PRESET-test.log
# and, on failure, the outputs; else ctest's closing lines and what was skipped.
run_tests() {
  local preset="$1"
  shift
  local log="$root/build/$preset-test.log"
  local start=$SECONDS
  cd "$root"
  echo "testing build/$preset"
  if ! ctest --preset "$preset" "$@" 2>&1 | tee "$log" | show_tests; then
    sed -n '/ tests failed out of /,$p' "$log" >&2
    fail "tests failed; their output is in $log"
  fi
  # Up to the list of tests that did not run, which report_cases sums up.
  sed -n '/ tests passed, /,/did not run:$/p' "$log" | sed '/did not run:$/d'
  echo "tested build/$preset in $((SECONDS - start)) s"
  report_cases "$preset"
}

# report_cases PRESET: how many cases the suites that CTest ran have, how many of
# them were skipped, and why.
report_cases() {
  local outputs="$root/build/$1/Testing/Temporary/LastTest.log"
  [[ -e "$outputs" ]] || return 0
  local passed skipped recordings
  passed="$(awk '/^\[  PASSED  \]/ { n += $4 } END { print n + 0 }' "$outputs")"
  skipped="$(grep -c '^\[  SKIPPED \] .* (' "$outputs" || true)"
  recordings="$(grep -c '^no recordings' "$outputs" || true)"
  echo "cases of C++ suites: $passed passed"
  if ((recordings > 0)); then
    echo "skipped: $recordings cases with real recordings, which are not all" \
      "in ${SYSID_REAL_DATA:-$root/../shared/data} (SYSID_REAL_DATA names" \
      "another folder)"
  fi
  if ((skipped > recordings)); then
    echo "skipped: $((skipped - recordings)) cases that this machine does not" \
      "allow; $outputs says why"
  fi
}

# Reads ctest's lines: a failed test with its output is shown at once, of the
# others a live line on a terminal, or one every tenth.
show_tests() {
  local line tenth last_tenth=0 failed=0
  while IFS= read -r line; do
    if [[ "$line" =~ ^\ *([0-9]+)/([0-9]+)\ Test\ +#.*\ Passed\  ]]; then
      failed=0
      if [[ -t 1 ]]; then
        printf '\rtests: %s/%s' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}"
        last_tenth=1
      else
        tenth=$((10 * BASH_REMATCH[1] / BASH_REMATCH[2]))
        if ((tenth > last_tenth)); then
          echo "tests: ${BASH_REMATCH[1]}/${BASH_REMATCH[2]}"
          last_tenth=$tenth
        fi
      fi
    elif [[ "$line" =~ ^\ *[0-9]+/[0-9]+\ Test\ +#.*\*\*\*Skipped\  ]]; then
      failed=0
    elif [[ "$line" =~ ^\ *[0-9]+/[0-9]+\ Test\ +# ]]; then
      failed=1
      echo
      echo "$line"
    elif [[ "$line" =~ ^\ +Start\ +[0-9]+: || "$line" == *' tests passed, '* ]]
    then
      failed=0
    elif ((failed)); then
      echo "$line"
    fi
  done
  if [[ -t 1 ]] && ((last_tenth > 0)); then
    echo
  fi
}

# tracked_files REGEX: paths from the root of the project's own files; all that
# are there where there is no git (a release's archive).
tracked_files() {
  cd "$root"
  if command -v git >/dev/null && git rev-parse --git-dir >/dev/null 2>&1; then
    git ls-files
  else
    find . -path ./build -prune -o -path ./.git -prune -o -type f -print |
      sed 's|^\./||' | sort
  fi | { grep -E "$1" || true; } |
    while IFS= read -r file; do
      # A tracked file may be deleted, and that not yet committed.
      if [[ -e "$file" ]]; then echo "$file"; fi
    done
}
