// A plug-in of mbsopt: plugin.json names it.
#include <mbsopt/plugin.hpp>

#include "terms.hpp"

MBSOPT_PLUGIN(terms) { add_terms(terms); }
