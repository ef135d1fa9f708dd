#pragma once

#include <string>
#include <vector>

#include "sysid/diagnosis/judgement.h"

namespace sysid {

struct Where {};
Where FindWhere(const Judgement& judgement);

}  // namespace sysid
