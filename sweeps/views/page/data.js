// The map: columns are unpacked, and give their value at any point.

function decodeBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

async function inflate(text) {
  const stream = new Blob([decodeBase64(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const NUMBER_TYPES = { f8: Float64Array, f4: Float32Array, i1: Int8Array, i2: Int16Array, i4: Int32Array };

/** Return little-endian numbers from bytes in the order: first bytes of all numbers, second bytes, … */
function unshuffle(bytes, dtype) {
  const Type = NUMBER_TYPES[dtype];
  const size = Type.BYTES_PER_ELEMENT;
  const n = bytes.length / size;
  const plain = new Uint8Array(bytes.length);
  for (let k = 0; k < size; k++) for (let i = 0, from = k * n; i < n; i++) plain[i * size + k] = bytes[from + i];
  return new Type(plain.buffer);
}

/** One variable of the map over all its points; `at` applies the scaling laws. */
class Column {
  constructor(description, map) {
    Object.assign(this, description);
    this.strides = [];
    let stride = 1;
    for (let k = this.shape.length - 1; k >= 0; k--) {
      this.strides[k] = this.shape[k] > 1 ? stride : 0;
      stride *= this.shape[k];
    }
    this.laws = map.dims.flatMap((dim, k) => {
      const power = this.powers[dim.name];
      return power ? [[k, map.coordinates[dim.name].values.map((value) => Math.abs(value) ** -power)]] : [];
    });
    this.scale = 2 ** this.exponent;
    this.isFlag = this.flags.length > 0;
    this.meanings = new Map(this.flags.map((flag) => [flag.value, flag.meaning]));
  }

  async load() {
    const holder = document.getElementById(`column-${this.id}`);
    this.values = unshuffle(await inflate(holder.textContent), this.dtype);
    holder.remove();
  }

  /** True if values of both signs occur in the map: the colours are then the same in every plane. */
  get isSigned() {
    return (this.hasBothSigns ??= this.values.some((value) => value < 0) && this.values.some((value) => value > 0));
  }

  /** Return the value at a place, which has an index along every dimension. */
  at(place) {
    let offset = 0;
    for (let k = 0; k < place.length; k++) offset += this.strides[k] * place[k];
    let value = this.values[offset] * this.scale;
    for (const [k, factors] of this.laws) value *= factors[place[k]];
    return value;
  }

  text(value) {
    return this.isFlag ? flagText(this.meanings.get(value) ?? String(value)) : withUnit(value, this.units, this.digits);
  }
}

function flagText(meaning) {
  return theMap.words[meaning] ?? meaning.replaceAll("_", " ");
}

const theMap = JSON.parse(document.getElementById("map-data").textContent);
theMap.order = theMap.dims.map((dim) => dim.name);
theMap.columns = Object.fromEntries(theMap.variables.map((variable) => [variable.name, new Column(variable, theMap)]));
theMap.existence = Object.values(theMap.columns).find((column) => column.role === "existence");

/** Return the value of a coordinate at a place; a coordinate along several dimensions is a column. */
function coordinateAt(name, place) {
  const coordinate = theMap.coordinates[name];
  if (!coordinate) return theMap.columns[name].at(place);
  return coordinate.values[coordinate.dim === null ? 0 : place[theMap.order.indexOf(coordinate.dim)]];
}

/** Loads Plotly, which the page contains deflated. */
async function loadPlotly() {
  const holder = document.getElementById("plotly");
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await inflate(holder.textContent));
  document.head.append(script);
  holder.remove();
}
