#pragma once

#include "sysid/io/byte_source.h"

namespace sysid {

// Throws InputError for a file that begins as those of a format do which is not
// read here: what it is, and how to make a CSV of it.
void RefuseForeignFormat(ByteSource* source);

}  // namespace sysid
