#include "sysid/diagnosis/where.h"
namespace sysid {
Where FindWhere(const Judgement&) { return {}; }
}  // namespace sysid
