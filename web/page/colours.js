// Colours of light: as a camera sees it, or false ones for errors.

/** False colours from dark to bright, of even steps in lightness (the colour map "viridis"). */
export const RAMP = [
  [0.267, 0.005, 0.329], [0.283, 0.141, 0.458], [0.254, 0.265, 0.53], [0.207, 0.372, 0.553],
  [0.164, 0.471, 0.558], [0.128, 0.567, 0.551], [0.135, 0.659, 0.518], [0.267, 0.749, 0.441],
  [0.478, 0.821, 0.318], [0.741, 0.873, 0.15], [0.993, 0.906, 0.144],
];

/**
 * Linear colours of vertices, three numbers each, of a quantity and a brightness in stops; with a
 * legend where colours are false.
 */
export function colours(light, quantity, stops) {
  if (quantity === "error") return falseColours(light);
  const source = quantity === "irradiance" ? light.irradiance : light.radiosity;
  const exposure = 2 ** stops / bright(source);
  const values = new Float32Array(source.length);
  for (let k = 0; k < source.length; k++) values[k] = soft(source[k] * exposure);
  return { values };
}

/** Linear up to 0.7, and rolled off above: highlights keep their shape. */
function soft(x) {
  return x <= 0.7 ? x : 0.7 + 0.3 * (1 - Math.exp((0.7 - x) / 0.3));
}

/** The value that 95 of 100 vertices stay below, in their brightest channel. */
function bright(source) {
  const count = source.length / 3;
  const step = Math.max(1, Math.floor(count / 20000));
  const values = [];
  for (let v = 0; v < count; v += step) {
    const value = Math.max(source[3 * v], source[3 * v + 1], source[3 * v + 2]);
    if (value > 0) values.push(value);
  }
  values.sort((a, b) => a - b);
  return values.length ? values[Math.floor(0.95 * (values.length - 1))] : 1;
}

/** Errors as shares of the mean radiosity, by powers of ten below the largest. */
function falseColours({ error, radiosity, positions }) {
  const count = positions.length / 3;
  let [sum, most] = [0, 0];
  for (let v = 0; v < count; v++) {
    sum += Math.hypot(radiosity[3 * v], radiosity[3 * v + 1], radiosity[3 * v + 2]);
    most = Math.max(most, error[v] ?? 0);
  }
  const mean = sum / Math.max(count, 1) || 1;
  const high = most || mean;
  const values = new Float32Array(3 * count);
  for (let v = 0; v < count; v++) {
    // Three powers of ten.
    const place = 1 + Math.log10(Math.max((error[v] ?? 0) / high, 1e-3)) / 3;
    const at = Math.min(Math.max(place, 0), 1) * (RAMP.length - 1);
    const low = Math.min(Math.floor(at), RAMP.length - 2);
    for (let k = 0; k < 3; k++) {
      const mixed = RAMP[low][k] + (RAMP[low + 1][k] - RAMP[low][k]) * (at - low);
      // From sRGB.
      values[3 * v + k] = mixed <= 0.04045 ? mixed / 12.92 : ((mixed + 0.055) / 1.055) ** 2.4;
    }
  }
  const percent = (share) => `${(100 * share).toPrecision(2)} %`;
  return {
    values,
    legend: { low: percent(high / mean / 1000), high: `${percent(high / mean)} of the mean radiosity` },
  };
}
