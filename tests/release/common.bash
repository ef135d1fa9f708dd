# What the tests of this folder share; sourced, not run.

if ! command -v git >/dev/null; then
  echo "no git: install Debian's package git"
  exit 77
fi
# Of nobody's configuration.
export HOME="$scratch" GIT_CONFIG_NOSYSTEM=1 GIT_CONFIG_GLOBAL=/dev/null
export GIT_AUTHOR_NAME=a GIT_AUTHOR_EMAIL=a@b
export GIT_COMMITTER_NAME=a GIT_COMMITTER_EMAIL=a@b
unset GIT_DIR GIT_WORK_TREE GIT_INDEX_FILE

wrong() {
  echo "wrong: $*" >&2
  exit 1
}
