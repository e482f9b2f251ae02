// The picture of a frame's bits.
import { extent, FRAME_BITS } from '../bits.js'
import { t } from '../i18n/index.js'

/** The bytes or bits of a field, in words. */
export function where(field) {
  const { byte, last, bit, lastBit } = extent(field)
  if (bit === null) return byte === last ? t('bits.byte', { byte }) : t('bits.bytes', { byte, last })
  if (byte === last && bit === lastBit) return t('bits.bit', { byte, bit })
  return t('bits.range', { byte, bit, last, lastBit })
}

/** Eight bytes of eight bits, bit 0 at the left, in the order of the bus. What does not fit is not drawn. */
export function Bits({ fields, ...rest }) {
  const ruler = Array.from({ length: 8 }, (_, byte) => (
    <span key={byte} class="byte" style={{ gridColumn: `${byte * 8 + 1} / span 8` }}>
      {byte}
    </span>
  ))
  const ticks = Array.from({ length: 64 }, (_, bit) => (
    <i key={bit} class={bit % 8 === 0 ? 'first' : ''} style={{ gridColumn: `${bit + 1}` }} />
  ))
  return (
    <div
      class="bits"
      role="img"
      aria-label={fields.map((field) => `${field.name}: ${where(field)}`).join('; ') || t('pdo.empty')}
      {...rest}
    >
      {ruler}
      {ticks}
      {fields
        .filter((field) => field.first_bit < FRAME_BITS)
        .map((field, place) => (
          <span
            key={field.first_bit}
            class={`bit-field tint-${place % 8}`}
            title={`${field.address} ${field.name} · ${where(field)}`}
            style={{
              gridColumn: `${field.first_bit + 1} / span ${Math.max(1, Math.min(field.bits, FRAME_BITS - field.first_bit))}`,
            }}
          >
            {field.name}
          </span>
        ))}
    </div>
  )
}
