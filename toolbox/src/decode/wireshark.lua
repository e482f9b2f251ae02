-- Names and values of CANopen frames in Wireshark, by data sheet.
--
--     wireshark -X lua_script:machine.lua -d can.subdissector,canopen bus.log
--
-- or in the folder of personal Lua plug-ins (Help, About Wireshark, Folders). Filters are made of the names of objects:
-- `lexican.position_actual_value > 100`, `lexican.object == "Statusword"`, `lexican.node == "feeder"`. Units are those that the
-- data sheet, DCF or machine sets: a setting that changes them on the bus is not followed.

local proto = Proto("lexican", "CANopen by data sheet")
local node_field = ProtoField.string("lexican.node", "Node")
local object_field = ProtoField.string("lexican.object", "Object")
local value_field = ProtoField.string("lexican.value", "Value")
local number_field = ProtoField.double("lexican.number", "Number")
local fields = { node_field, object_field, value_field, number_field }

-- A field for the number of each object of a data sheet, by the object's name.
local number_fields = {}
for _, sheet in pairs(sheets) do
    for _, entry in pairs(sheet.objects) do
        if entry.bits and not number_fields[entry.field] then
            number_fields[entry.field] = ProtoField.double("lexican." .. entry.field, entry.name)
            fields[#fields + 1] = number_fields[entry.field]
        end
    end
end
proto.fields = fields

local function field(name)
    local extractor = Field.new("canopen." .. name)
    return function()
        local info = extractor()
        return info and info.value
    end
end
local cob_id, node_id = field("cob_id"), field("node_id")
local main_idx, sub_idx = field("sdo.main_idx"), field("sdo.sub_idx")
local ccs, scs, expedited, sdo_data = field("sdo.ccs"), field("sdo.scs"), field("sdo.e"), field("sdo.data.bytes")
local pdo_data, emcy_code = field("pdo.data.bytes"), field("em.err_code")

-- What these bits of the data are, least significant first; nil of more than a double holds.
local function take(data, from, bits, signed)
    if bits > 53 then return nil end
    local number = 0
    for bit = from + bits - 1, from, -1 do
        number = 2 * number + math.floor(data:get_index(math.floor(bit / 8)) / 2 ^ (bit % 8)) % 2
    end
    if signed and number >= 2 ^ (bits - 1) then number = number - 2 ^ bits end
    return number
end

local function text_of(entry, number)
    if entry.unit then return string.format("%.10g %s", number * entry.factor, entry.unit) end
    if entry.values and entry.values[number] then return string.format("%s (%d)", entry.values[number], number) end
    if entry.flags then
        local set = {}
        for _, flag in ipairs(entry.flags) do
            local low, width, name = flag[1], flag[2], flag[3]
            local value = math.floor(number / 2 ^ low) % 2 ^ width
            if value > 0 then set[#set + 1] = width == 1 and name or string.format("%s %d", name, value) end
        end
        return string.format("%Xh%s%s", number, #set > 0 and ": " or "", table.concat(set, " + "))
    end
    return string.format("%.10g", number)
end

-- Puts an object and its number, if it is known, into the tree and the column.
local function show(tree, pinfo, node, entry, number)
    local text = number and text_of(entry, number)
    local line = text and entry.name .. " = " .. text or entry.name
    local item = tree:add(object_field, entry.name)
    item:set_text(line)
    if text then
        item:add(value_field, text)
        item:add(number_field, number * (entry.factor or 1))
        item:add(number_fields[entry.field], number * (entry.factor or 1))
    end
    pinfo.cols.info:append("  " .. node.name .. ": " .. line)
end

-- Segments of a transfer do not name its object: of each frame, the object of the transfer that it belongs to.
local transfer_of_node, transfer_of_frame = {}, {}

function proto.init()
    transfer_of_node, transfer_of_frame = {}, {}
end

function proto.dissector(_, pinfo, root)
    local id, node = cob_id(), node_id() and nodes[node_id()]
    local pdo, data = id and pdos[id], pdo_data()
    if pdo and data then
        local bits, from = 0, 0
        for _, mapped in ipairs(pdo) do bits = bits + mapped[2] end
        -- It is not as it is configured, or not as this script was told.
        if 8 * data:len() < bits then return end
        local tree = root:add(proto)
        tree:add(node_field, nodes[pdo.node].name)
        for _, mapped in ipairs(pdo) do
            local entry = nodes[pdo.node].sheet.objects[mapped[1]]
            if entry then
                show(tree, pinfo, nodes[pdo.node], entry, entry.bits and take(data, from, mapped[2], entry.signed))
            end
            from = from + mapped[2]
        end
    elseif node and (ccs() or scs()) then
        if not pinfo.visited then
            if main_idx() then transfer_of_node[node_id()] = main_idx() * 256 + sub_idx() end
            transfer_of_frame[pinfo.number] = transfer_of_node[node_id()]
        end
        local entry = node.sheet.objects[transfer_of_frame[pinfo.number]]
        if entry then
            local tree = root:add(proto)
            tree:add(node_field, node.name)
            local number = entry.bits and expedited() and sdo_data() and entry.bits <= 8 * sdo_data():len()
                and take(sdo_data(), 0, entry.bits, entry.signed)
            show(tree, pinfo, node, entry, number)
        end
    elseif node and emcy_code() and node.sheet.emergencies[emcy_code()] then
        local tree = root:add(proto)
        tree:add(node_field, node.name)
        tree:add(value_field, node.sheet.emergencies[emcy_code()])
        pinfo.cols.info:append("  " .. node.name .. ": " .. node.sheet.emergencies[emcy_code()])
    end
end

register_postdissector(proto)
