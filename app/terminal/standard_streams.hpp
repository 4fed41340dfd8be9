#pragma once

namespace mbsopt::inline app {

// Opens /dev/null in place of closed standard streams. Otherwise the first opened file, such as a journal, would be
// taken for one of them and receive messages.
void open_missing_standard_streams();

}  // namespace mbsopt::inline app
