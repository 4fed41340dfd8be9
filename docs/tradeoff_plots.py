"""Work-precision plots: log-log, as SVG."""

import math

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7a5195", "#666666")


def log_plot(path, title, x_label, y_label, series, beside={}, front=()):
    """Lines on two logarithmic axes; series: name -> [(x, y)]; beside: name -> points off that line; front: points to mark."""
    width, height, left, right, top, bottom = 800, 400, 70, 230, 34, 48
    points = [p for line in (*series.values(), *beside.values()) for p in line]
    if not points:
        return False

    def ends(values):
        return math.floor(math.log10(min(values)) - 0.05), math.ceil(math.log10(max(values)) + 0.05)

    (x0, x1), (y0, y1) = ends([p[0] for p in points]), ends([p[1] for p in points])
    px = lambda x: left + (math.log10(x) - x0) / (x1 - x0) * (width - left - right)
    py = lambda y: top + (y1 - math.log10(y)) / (y1 - y0) * (height - top - bottom)
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="system-ui,sans-serif" '
           f'font-size="12"><rect width="{width}" height="{height}" fill="#fff"/>',
           f'<text x="{left}" y="20" font-size="14" font-weight="600" fill="#1b1f24">{title}</text>']
    power = lambda k: f'10<tspan dy="-4" font-size="9">{k}</tspan>'
    for k in range(x0, x1 + 1):
        x = px(10.0**k)
        svg.append(f'<path d="M{x:.1f} {top}V{height - bottom}" stroke="#dfe3e8"/>'
                   f'<text x="{x:.1f}" y="{height - bottom + 18}" text-anchor="middle" fill="#5d6670">{power(k)}</text>')
    stride = max(1, math.ceil((y1 - y0) / 8))
    for k in range(math.ceil(y0 / stride) * stride, y1 + 1, stride):
        y = py(10.0**k)
        svg.append(f'<path d="M{left} {y:.1f}H{width - right}" stroke="#dfe3e8"/>'
                   f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end" fill="#5d6670">{power(k)}</text>')
    svg.append(f'<rect x="{left}" y="{top}" width="{width - left - right}" height="{height - top - bottom}" fill="none" stroke="#5d6670"/>')
    svg.append(f'<text x="{(left + width - right) / 2}" y="{height - 10}" text-anchor="middle" fill="#5d6670">{x_label}</text>')
    svg.append(f'<text transform="translate(16 {(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle" fill="#5d6670">{y_label}</text>')
    for x, y in front:
        svg.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="5.5" fill="none" stroke="#1b1f24"/>')
    for i, (name, line) in enumerate(series.items()):
        colour, dash = COLOURS[i % 8], ' stroke-dasharray="6 4"' if i >= 8 else ""
        path_text = "L".join(f"{px(x):.1f} {py(y):.1f}" for x, y in line)
        svg.append(f'<path d="M{path_text}" fill="none" stroke="{colour}" stroke-width="1.6"{dash}/>')
        svg += [f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="2.2" fill="{colour}"/>' for x, y in line]
        svg += [f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="1.8" fill="#fff" stroke="{colour}"/>' for x, y in beside.get(name, ())]
        y = top + 10 + 18 * i
        svg.append(f'<path d="M{width - right + 14} {y}h24" stroke="{colour}" stroke-width="1.6"{dash}/>'
                   f'<text x="{width - right + 44}" y="{y + 4}" fill="#1b1f24">{name}</text>')
    keys = [("error beside its line", 'r="1.8" fill="#fff" stroke="#5d6670"')] if any(beside.values()) else []
    keys += [("Pareto front", 'r="5.5" fill="none" stroke="#1b1f24"')] if front else []
    for i, (name, circle) in enumerate(keys, len(series)):
        y = top + 10 + 18 * i
        svg.append(f'<circle cx="{width - right + 26}" cy="{y}" {circle}/><text x="{width - right + 44}" y="{y + 4}" fill="#1b1f24">{name}</text>')
    path.write_text("\n".join(svg) + "\n</svg>\n")
    return True
