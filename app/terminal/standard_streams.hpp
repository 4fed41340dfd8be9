#pragma once

namespace mbsopt {

// Opens /dev/null in place of standard streams that are closed. Else the first file that is opened, such as a journal,
// would be taken for one of them, and messages would be written into it.
void open_missing_standard_streams();

}  // namespace mbsopt
