#include "models/error.h"
#include "sysid/io/mat_file.h"

namespace sysid {

std::unique_ptr<TableFile> OpenMatFile(ByteSource source, const std::string&) {
  throw InputError(source.path(),
                   "is a MATLAB file, and this sysid was built without the "
                   "library that reads them",
                   "install libmatio-dev and build again, or save the columns "
                   "as CSV: writetable(table(t, q), 'run.csv')");
}

}  // namespace sysid
