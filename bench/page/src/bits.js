// PDOs as pictures: where each object lies in the 64 bits of a frame.

export const FRAME_BITS = 64

/** Places fields one after the other, from bit 0 on. */
export function place(fields) {
  let first = 0
  return fields.map((field) => {
    const placed = { ...field, first_bit: first }
    first += field.bits
    return placed
  })
}

export const usedBits = (fields) => fields.reduce((sum, field) => sum + field.bits, 0)

/** The index of the field that has a bit; the number of fields if none has it. */
export function placeOfBit(fields, bit) {
  const found = fields.findIndex(({ first_bit: first, bits }) => bit >= first && bit < first + bits)
  return found < 0 ? fields.length : found
}

/** Moves the field at index `from` to index `to`; does nothing if `to` is outside of the list. */
export function move(fields, from, to) {
  if (to < 0 || to >= fields.length || from === to) return fields
  const rest = fields.filter((_, each) => each !== from)
  return place([...rest.slice(0, to), fields[from], ...rest.slice(to)])
}

export const remove = (fields, at) => place(fields.filter((_, each) => each !== at))
export const insert = (fields, at, field) => place([...fields.slice(0, at), field, ...fields.slice(at)])

/** The bytes or bits of a field, as engineers write them: `byte 0`, `bytes 2–5`, `byte 1, bit 3`. */
export function extent({ first_bit: first, bits }) {
  const [byte, last] = [Math.floor(first / 8), Math.floor((first + bits - 1) / 8)]
  const whole = first % 8 === 0 && bits % 8 === 0
  return { byte, last, bit: whole ? null : first % 8, lastBit: whole ? null : (first + bits - 1) % 8 }
}
