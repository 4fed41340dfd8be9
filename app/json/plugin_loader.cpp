#include "app/json/plugin_loader.hpp"

#include <dlfcn.h>

#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

#include "optim/problem/plugin.hpp"

namespace mbsopt::inline app {
namespace {

std::string last_error() {
  const char* const words = dlerror();
  return words ? words : "unknown error of the loader";
}

template <class Function>
Function* symbol(void* library, const char* name) {
  void* const found = dlsym(library, name);
  if (!found)
    throw std::runtime_error(std::string("is no plug-in of mbsopt: it lacks ") + name +
                             "(), which MBSOPT_PLUGIN of <mbsopt/plugin.hpp> defines");
  return reinterpret_cast<Function*>(found);  // POSIX: dlsym
}

}  // namespace

void load_plugin(const std::filesystem::path& file, NamedTerms& terms) {
  // The path is absolute, because the loader searches the system's folders for plain names.
  const std::filesystem::path path = std::filesystem::absolute(file);
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none))
    throw std::runtime_error("there is no file '" + file.string() + "'; a shared library is expected");
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw std::runtime_error("cannot be loaded: " + last_error());
  const char* const interface = symbol<const char*()>(library, "mbsopt_plugin_interface")();
  if (std::string_view(interface) != kPluginInterface)
    throw std::runtime_error(std::string("was compiled for another program: its interface is '") + interface +
                             "', that of this program is '" + kPluginInterface + "'; compile it anew");
  const auto add_terms = symbol<void(NamedTerms&)>(library, "mbsopt_plugin");
  try {
    add_terms(terms);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("its registration threw: ") + error.what());
  } catch (...) {
    throw std::runtime_error("its registration threw what is no std::exception");
  }
}

}  // namespace mbsopt::inline app
