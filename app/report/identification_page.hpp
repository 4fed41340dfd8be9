// The result of an identification for people: at the terminal and on the page.
#pragma once

#include <string>
#include <vector>

#include "app/report/run_page.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt::inline app {

// effort is the text of effort() in multistart.hpp.
void show_fit(RunPage& page, const IdentificationResult& fit, const std::string& effort);

// Measured and model over time, a plot per channel of each record, with plots of its residuals. start holds the initial
// values; channels that it lacks are left out.
void add_fit_plots(RunPage& page, const Problem& problem, const std::vector<CsvTable>& data,
                   const IdentificationResult& fit, const IdentificationResult& start);

}  // namespace mbsopt::inline app
