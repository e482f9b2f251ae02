// What the page knows: the bench's view, a signal per field, and what the page itself has chosen.
import { batch, computed, signal } from '@preact/signals'

/** The view before anything was heard; names and shapes are those of `View` in bench/src/view.rs. */
export const EMPTY = {
  time: 0,
  bus: {
    name: '',
    is_writable: false,
    bit_rate: null,
    state: '',
    frames: 0,
    frames_per_second: 0,
    load_percent: null,
    load_percent_peak: null,
    missing_frames: 0,
    ids: [],
    troubles: [],
  },
  nodes: [],
  drives: [],
  devices: [],
  jobs: [],
  watched: [],
  trace: { first: 0, end: 0 },
  hands: { holder: null, faces: 0 },
  log: null,
}

export const view = Object.fromEntries(Object.entries(EMPTY).map(([field, value]) => [field, signal(value)]))

/** `connecting`, `open`, `lost`, `ended`, or `refused` when the bench does not know the token. */
export const connection = signal('connecting')
/** The number of this page among the faces, and the bench's version. */
export const face = signal(null)
export const version = signal('')

export const hasHands = computed(() => connection.value === 'open' && view.hands.value.holder === face.value)
/** Whether something on the bus can be changed from here; why not, as a key of the dictionary. */
export const whyNot = computed(() => {
  if (connection.value !== 'open') return 'hands.lost'
  if (!view.bus.value.is_writable) return 'hands.read-only'
  return hasHands.value ? null : 'hands.first'
})

/** Takes over the fields of a view that have changed. Fields that the page does not know are left alone. */
export function applyView(changes) {
  batch(() => {
    for (const [field, value] of Object.entries(changes)) if (field in view) view[field].value = value
  })
}

/**
 * How the last stop went, by what the drives have confirmed since: one that was refused is sent until each drive stands. `last` is that of
 * bench.js.
 */
export function stopSince(last, drives) {
  if (last?.state !== 'refused') return last
  if (drives.some((drive) => drive.unconfirmed)) return last.isSent ? last : { ...last, isSent: true }
  return last.isSent ? { ...last, state: 'confirmed' } : last
}

export const TABS = ['nodes', 'objects', 'pdos', 'trace', 'plots', 'drives', 'bus', 'devices']

/** `#objects/5`: the tab, and the node that is looked at. */
export function parsePlace(hash) {
  const [tab, node] = hash.replace(/^#/, '').split('/')
  const id = Number(node)
  return { tab: TABS.includes(tab) ? tab : 'nodes', node: Number.isInteger(id) && id >= 1 && id <= 127 ? id : null }
}

const place = parsePlace(globalThis.location?.hash ?? '')
export const tab = signal(place.tab)
export const chosenNode = signal(place.node)

/** The node that is looked at: the chosen one, else the first. */
export const node = computed(() => {
  const nodes = view.nodes.value
  return nodes.find((each) => each.id === chosenNode.value) ?? nodes[0] ?? null
})
export const nodeId = computed(() => node.value?.id ?? null)

export function goTo(nextTab, nextNode = chosenNode.value) {
  batch(() => {
    tab.value = nextTab
    chosenNode.value = nextNode
  })
  history.replaceState(null, '', nextNode === null ? `#${nextTab}` : `#${nextTab}/${nextNode}`)
}

/** The number of the trace's row that is to be shown, until it is. */
export const wantedRow = signal(null)

export function goToRow(number) {
  wantedRow.value = number
  goTo('trace')
}
